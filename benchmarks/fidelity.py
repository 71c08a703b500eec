"""Agreement of the models of searches with finite elements: ``python -m benchmarks.fidelity``.

Five studies, selected by ``--only correlate,search,levels,meshes,joints``:

- correlate: compare the efficiencies of several hundred designs in the spring model, and as frames
  with one element in each beam as searches use them, with frames of 8 elements,
- search: run `bellcrank design` with several seeds, and compare the efficiencies of its designs in
  the model of the search with those of frames of 8 elements,
- levels: compute the efficiencies of the bundled designs at all levels of analysis,
- meshes: compute the efficiency of the full crane in plane stress for several mesh sizes,
- joints: compare the energies of frames with joints of several sizes with those of the sheet in
  the record of `levels`.

Designs that lose stability in the frame analysis are counted and excluded from medians. Designs
with contact are counted. The results are written to ``docs/validation/*.json`` and ``*.png``, and
tables are printed.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import spearmanr

from bellcrank.fem import FemSettings, levels
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    ModelEvaluator,
    SpringEvaluator,
    Status,
    model_evaluator,
)
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import (
    Design,
    Problem,
    builtin,
    find_problem,
    gallery_design,
    unpack_mask,
)
from bellcrank.part import PartSpec, frame_problem
from bellcrank.plots import style
from bellcrank.plots.saving import save_figure
from bellcrank.provenance import provenance
from bellcrank.search import (
    advance_chain,
    make_evaluator,
    read_settings,
    start_chain,
)
from bellcrank.search.cleaning import clean
from bellcrank.workflows import (
    complete_design,
    find_design,
    spec_for,
    start_design,
    validate,
)

FOLDER = Path(__file__).parents[1] / "docs" / "validation"
PROBLEMS = ("crane", "anti-parallel")
SIZES = (2.0, 1.4, 1.0, 0.7, 0.5)
"""Largest sides of triangles, mm."""
WIDTH = 2.0
"""Strut width, mm."""
JOINTS = (0.0, 0.2, 0.3, 0.4)
"""Lengths of the ends of struts that do not deform, in widths."""
STEPS = 5_000
"""Steps of each chain that samples designs."""
CHAINS = {"paper": 8, "basin-hopping": 4}
"""Numbers of chains that sample designs, for each search."""
SEEDS = 8
"""Number of searches of each problem in `search_study`."""


def sample_designs(name: str) -> list[str]:
    """Return the masks of accepted designs of chains, one per 250 steps, cleaned and distinct."""
    problem = find_problem(name)
    masks: dict[str, None] = {}
    for search, count in CHAINS.items():
        for seed in range(count):
            settings = read_settings({"search": search, "steps": STEPS, "seed": seed})
            evaluator = make_evaluator(problem, settings)
            state = start_chain(evaluator, settings, 0)
            while state.step < STEPS:
                state, rows = advance_chain(evaluator, settings, 0, state)
                indices = np.flatnonzero(rows.accepted & (rows.status == Status.CONVERGED))
                if len(indices):
                    bits = np.unpackbits(rows.mask[indices[-1]])[: problem.lattice.beam_count]
                    masks[clean(Design(problem, bits.astype(bool))).mask_hex] = None
    return list(masks)


def analyse_frame(job: tuple[str, str, float]) -> dict[str, object]:
    """Compute the nonlinear frame analysis of a design: problem, mask, strut width in mm."""
    name, mask, width = job
    problem = find_problem(name)
    design = Design(problem, unpack_mask(mask, problem.lattice.beam_count))
    part = PartSpec(width=width).of(design)
    analysis = levels["frame"](part, FemSettings())
    return {
        "mask": mask,
        "status": analysis.status.value,
        "reached": analysis.last.load,
        "frame": analysis.efficiency,
        "force": float(np.hypot(*analysis.last.force)) / (part.stiffness_unit * part.scale),
        "contacts": len(analysis.contacts.pairs),
    }


def efficiencies(evaluator: ModelEvaluator, masks: list[str]) -> np.ndarray:
    """Return the efficiency of each design; nan without a stable response."""
    found = []
    for mask in masks:
        bits = unpack_mask(mask, evaluator.problem.lattice.beam_count)
        response = evaluator.evaluate(bits, VERIFICATION_INCREMENT)
        found.append(response.efficiency if response.status is Status.CONVERGED else np.nan)
    return np.array(found)


def agreement(model: np.ndarray, frame: np.ndarray) -> dict[str, float]:
    """Return measures of agreement between two efficiencies of the same designs."""
    finite = np.isfinite(model) & np.isfinite(frame)
    x, y = model[finite], frame[finite]
    return {
        "designs": int(finite.sum()),
        "r_squared": float(np.corrcoef(x, y)[0, 1] ** 2),
        "determination": float(1.0 - ((x - y) ** 2).sum() / ((y - y.mean()) ** 2).sum()),
        "rank_correlation": float(spearmanr(x, y)[0]),
        "slope": float(np.polyfit(x, y, 1)[0]),
        "median_ratio": float(np.median(y / x)),
    }


def frames_of_searches(problem: Problem, masks: list[str]) -> np.ndarray:
    """Return the efficiency of each design as a frame of a search; nan without a response."""
    frame = frame_problem(problem, PartSpec(width=WIDTH))
    return efficiencies(model_evaluator(frame), masks)


def correlation_study(pool: ProcessPoolExecutor) -> None:
    """Compare both models of searches with frame analyses, and draw the figure."""
    record: dict[str, object] = {"width": WIDTH, "provenance": provenance()}
    columns = {}
    for name in PROBLEMS:
        masks = sample_designs(name)
        jobs = [(name, mask, WIDTH) for mask in masks]
        rows = list(pool.map(analyse_frame, jobs, chunksize=8))
        frame = np.array([row["frame"] for row in rows], dtype=np.float64)
        problem = find_problem(name)
        paper = efficiencies(SpringEvaluator(problem), masks)
        element = frames_of_searches(problem, masks)
        for row, first, second in zip(rows, paper, element, strict=True):
            row |= {"paper": first, "element": second}
        measures = {"paper": agreement(paper, frame), "element": agreement(element, frame)}
        columns[name] = (paper, element, frame)
        record[name] = {
            **measures,
            "designs": len(rows),
            "not_stable_as_frames": sum(row["status"] != "converged" for row in rows),
            "touching_as_frames": sum(row["contacts"] > 0 for row in rows),
            "rows": [_plain(row) for row in rows],
        }
        for kind, values in measures.items():
            cells = " | ".join(f"{value:.3g}" for value in values.values())
            print(f"| {name} | {kind} | {cells} |")
    _write("correlation", record)
    _scatter(columns)


def run_search(job: tuple[str, int]) -> dict[str, object]:
    """Run the search of `bellcrank design` for a part, and analyse its design with 8 elements."""
    name, seed = job
    with TemporaryDirectory() as temporary:
        folder = start_design(
            find_problem(name), read_settings({"seed": seed}), Path(temporary) / "run",
            PartSpec(width=WIDTH),
        )  # fmt: skip
        report = complete_design(folder, workers=1)
    assert report is not None
    selection = report.selection
    mask = selection.design.mask_hex
    return {
        "seed": seed,
        "proposals": report.proposals,
        "search": selection.efficiency_after,
        **analyse_frame((name, mask, WIDTH)),
    }


def search_study(pool: ProcessPoolExecutor) -> None:
    """Compare the efficiencies of designs in the model of their search and by 8 elements."""
    record: dict[str, object] = {"width": WIDTH, "provenance": provenance()}
    for name in PROBLEMS:
        rows = list(pool.map(run_search, [(name, seed) for seed in range(SEEDS)]))
        stable = [row for row in rows if row["status"] == "converged"]
        model = float(np.median([row["search"] for row in stable]))
        frame = float(np.median([row["frame"] for row in stable]))
        deviations = [abs(row["frame"] / row["search"] - 1.0) for row in stable]  # type: ignore[operator]
        deviation = float(np.median(deviations))
        touching = sum(bool(row["contacts"]) for row in stable)
        record[name] = {
            "search": model, "frame": frame, "median_deviation": deviation,
            "not_stable_as_frames": len(rows) - len(stable), "touching_as_frames": touching,
            "rows": [_plain(row) for row in rows],
        }  # fmt: skip
        print(
            f"| {name} | {model:.2f} | {frame:.2f} | {deviation:.1%} | "
            f"{len(rows) - len(stable)} of {len(rows)} | {touching} of {len(rows)} |",
            flush=True,
        )
    _write("search", record)


def analyse_level(job: tuple[str, str, FemSettings]) -> dict[str, object]:
    """Analyse a bundled design at one level, with struts of `WIDTH`."""
    name, level, settings = job
    design = find_design(name)
    spec = spec_for(design).changed({"width": WIDTH})
    validation = validate(design, spec, [(level, settings)])
    return {"design": name, **validation.to_dict(), **validation.analyses[0].to_dict()}


def level_study(pool: ProcessPoolExecutor) -> None:
    """Analyse the bundled designs at all levels."""
    designs = [
        f"{kind}:{name}"
        for name in builtin
        for kind in ("human", "machine")
        if find_problem(name).lattice.dimension == 2 and gallery_design(kind, name)  # type: ignore[arg-type]
    ]
    columns = {
        "frame, linear": ("frame", FemSettings(linear=True)),
        "frame, euler-bernoulli": ("frame", FemSettings()),
        "frame, timoshenko": ("frame", FemSettings(theory="timoshenko")),
        "plane, st-venant-kirchhoff": ("plane", FemSettings(law="st-venant-kirchhoff")),
        "plane, neo-hookean": ("plane", FemSettings()),
        "solid, linear": ("solid", FemSettings(linear=True)),
    }
    record: dict[str, object] = {"width": WIDTH, "provenance": provenance()}
    for design in designs:
        jobs = [(design, *column) for column in columns.values()]
        rows = dict(zip(columns, pool.map(analyse_level, jobs), strict=True))
        discrete_model = rows["frame, linear"]["discrete_model"]
        record[design] = {
            "discrete_model": discrete_model,
            **{name: _selected(row) for name, row in rows.items()},
        }
        values = [discrete_model["efficiency"], *(row["efficiency"] for row in rows.values())]  # type: ignore[index]
        cells = " | ".join("-" if value is None else f"{value:.3f}" for value in values)
        print(f"| {design} | {cells} |", flush=True)
    _write("levels", record)


def analyse_joints(name: str) -> dict[str, float]:
    """Return the energy of a bundled design as a frame with joints of several sizes, or its own."""
    found = {}
    for size in JOINTS:
        part = PartSpec(width=WIDTH, joint=size * WIDTH).of(find_design(name))
        found[f"{size:g}"] = levels["frame"](part, FemSettings()).last.energy
    design, spec = find_design(name), PartSpec(width=WIDTH)
    own = with_joints(frame_problem(design.problem, spec), design.mask)
    part = spec.of(replace(design, problem=own))
    found["of the design"] = levels["frame"](part, FemSettings()).last.energy
    return found


def joint_study(pool: ProcessPoolExecutor) -> None:
    """Compare frames with joints of several sizes with the sheet."""
    sheets = json.loads((FOLDER / "levels.json").read_text(encoding="utf-8"))
    names = [name for name in sheets if ":" in name]
    record: dict[str, object] = {"width": WIDTH, "provenance": provenance()}
    for name, found in zip(names, pool.map(analyse_joints, names), strict=True):
        sheet = sheets[name]["plane, neo-hookean"]["energy_N_mm"]
        ratios = {size: energy / sheet for size, energy in found.items()}
        record[name] = {"sheet_energy_N_mm": sheet, "energy_ratio": ratios}
        print(f"| `{name}` | {' | '.join(f'{each:.2f}' for each in ratios.values())} |", flush=True)
    _write("joints", record)


def analyse_mesh(size: float) -> dict[str, object]:
    """Analyse the full crane in plane stress with triangles of a largest side, mm."""
    part = PartSpec(width=WIDTH).of(find_problem("crane").full_design())
    linear = levels["plane"](part, FemSettings(size=size, linear=True))
    nonlinear = levels["plane"](part, FemSettings(size=size))
    return {
        "size": size,
        "unknowns": nonlinear.cost["unknowns"],
        "small_displacements": linear.efficiency,
        "efficiency": nonlinear.efficiency,
        "force_N": float(np.hypot(*nonlinear.last.force)),
    }


def mesh_study(pool: ProcessPoolExecutor) -> None:
    """Analyse the full crane with several mesh sizes."""
    rows = list(pool.map(analyse_mesh, SIZES))
    for row in rows:
        print("| " + " | ".join(f"{value:.6g}" for value in row.values()) + " |")
    _write("meshes", {"width": WIDTH, "rows": rows, "provenance": provenance()})


def _selected(row: dict[str, object]) -> dict[str, object]:
    """Return the results of an analysis that are stored in the record."""
    keys = (
        "status", "reached", "loss_of_stability", "efficiency", "mean_output_displacement_mm",
        "input_force_N", "energy_N_mm", "von_mises_MPa", "principal_strain", "cost", "warnings",
    )  # fmt: skip
    return {key: row[key] for key in keys}


def _plain(row: dict[str, object]) -> dict[str, object]:
    """Round numbers to six decimals, and replace those that are not finite by None."""
    return {
        key: (round(value, 6) if np.isfinite(value) else None)
        if isinstance(value, float)
        else value
        for key, value in row.items()
    }


def _write(name: str, record: dict[str, object]) -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n")


def _scatter(found: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]) -> None:
    """Draw the efficiency of frames of 8 elements against that of both models of searches."""
    figure = style.new_figure(9.0, 4.4)
    style.add_heading(
        figure,
        f"Models of searches against frames of 8 elements, struts {WIDTH:g} mm wide on 10 mm",
        "each dot is one design of a search; on the line both efficiencies are equal",
        0.25,
        0.2,
    )
    for index, title in enumerate(("springs of the paper", "frames, as searched")):
        axes = figure.add_axes((0.075 + 0.5 * index, 0.13, 0.40, 0.66))
        for (name, columns), colour in zip(found.items(), (style.OUTPUT, style.INPUT), strict=True):
            measures = agreement(columns[index], columns[2])
            label = f"{name}: R² {measures['r_squared']:.3f}"
            axes.plot(
                columns[index], columns[2], linestyle="none", marker="o", markersize=3.0,
                color=colour, alpha=0.6, markeredgewidth=0.0, label=label,
            )  # fmt: skip
        values = np.concatenate([np.concatenate(columns) for columns in found.values()])
        low, high = np.nanmin(values), np.nanmax(values)
        axes.plot([low, high], [low, high], color=style.IDLE, linewidth=1.0, zorder=1)
        font = {"family": style.FONT, "size": style.SMALL_SIZE, "color": style.INK}
        axes.set_xlabel(f"efficiency by {title}", **font)
        axes.set_ylabel("efficiency by frames of 8 elements", **font)
        axes.tick_params(labelsize=style.SMALL_SIZE, colors=style.NOTE)
        axes.legend(frameon=False, prop={"family": style.FONT, "size": style.SMALL_SIZE})
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    save_figure(figure, FOLDER / "correlation.png", overwrite=True)


STUDIES = {
    "correlate": correlation_study,
    "search": search_study,
    "levels": level_study,
    "meshes": mesh_study,
    "joints": joint_study,
}


def main() -> None:
    """Run the selected studies."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default=",".join(STUDIES), help="names of studies")
    selected = parser.parse_args().only.split(",")
    with ProcessPoolExecutor(max_workers=2) as pool:
        for name in selected:
            STUDIES[name](pool)


if __name__ == "__main__":
    main()
