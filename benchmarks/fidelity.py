"""Agreement of the spring model with finite elements: ``python -m benchmarks.fidelity``.

Five studies, selected by ``--only correlate,width,search,levels,meshes``:

- correlate: efficiencies of some hundred designs from searches in the spring model, with the
  paper's stiffness and with that of the struts, compared with nonlinear frames,
- width: stiffness of the angular springs that fits frames of each strut width best, and the strut
  width to which the paper's stiffness corresponds,
- search: efficiency of the best design of a search in the spring model and as a frame, with either
  stiffness, and with ranking by frames,
- levels: efficiencies of the bundled designs at all levels of analysis,
- meshes: dependence of the plane analysis of the full crane on the size of the triangles.

Designs that snap or have contact as frames are counted and listed, not averaged.
Results go to ``docs/validation/*.json`` and ``*.png``, tables to standard output.
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
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import (
    Design,
    Problem,
    Stiffness,
    builtin,
    find_problem,
    gallery_design,
    pack_mask,
    unpack_mask,
)
from bellcrank.part import PartSpec, calibrated
from bellcrank.part.calibration import JOINT
from bellcrank.plots import style
from bellcrank.plots.saving import save_figure
from bellcrank.provenance import provenance
from bellcrank.search import (
    SearchSettings,
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
"""Of triangles, mm."""
WIDTH = 2.0
WIDTHS = (1.0, 1.5, 2.0, 3.0, 4.0)
FACTORS = np.round(np.arange(0.30, 1.01, 0.05), 2)
STEPS = 5_000
CHAINS = {"paper": 8, "basin-hopping": 4}
SEEDS = 8


def sampled(name: str) -> list[str]:
    """Masks that chains of a problem stood at, every 250 steps; cleaned, without doubles."""
    problem = find_problem(name)
    found: dict[str, None] = {}
    for search, count in CHAINS.items():
        for seed in range(count):
            settings = read_settings({"search": search, "steps": STEPS, "seed": seed})
            evaluator = make_evaluator(problem, settings)
            state = start_chain(evaluator, settings, 0)
            while state.step < STEPS:
                state, rows = advance_chain(evaluator, settings, 0, state)
                taken = np.flatnonzero(rows.accepted & (rows.status == Status.CONVERGED))
                if len(taken):
                    bits = np.unpackbits(rows.mask[taken[-1]])[: problem.lattice.beam_count]
                    found[clean(Design(problem, bits.astype(bool))).mask_hex] = None
    return list(found)


def frame_of(job: tuple[str, str, float, float | None]) -> dict[str, object]:
    """Analyse a design as a nonlinear frame; stroke in lattice units, or the problem's."""
    name, mask, width, stroke = job
    problem = find_problem(name)
    if stroke is not None:
        problem = replace(problem, input=replace(problem.input, amount=stroke))
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


def discrete(problem: Problem, masks: list[str]) -> np.ndarray:
    """Efficiency of each design by the discrete model; nan where it is not unique."""
    evaluator = SpringEvaluator(problem)
    found = []
    for mask in masks:
        response = evaluator.evaluate(
            unpack_mask(mask, problem.lattice.beam_count), VERIFICATION_INCREMENT
        )
        found.append(response.efficiency if response.status is Status.CONVERGED else np.nan)
    return np.array(found)


def agreement(model: np.ndarray, frame: np.ndarray) -> dict[str, float]:
    """Compare two efficiencies of the same designs."""
    both = np.isfinite(model) & np.isfinite(frame)
    x, y = model[both], frame[both]
    return {
        "designs": int(both.sum()),
        "r_squared": float(np.corrcoef(x, y)[0, 1] ** 2),
        "determination": float(1.0 - ((x - y) ** 2).sum() / ((y - y.mean()) ** 2).sum()),
        "rank_correlation": float(spearmanr(x, y)[0]),
        "slope": float(np.polyfit(x, y, 1)[0]),
        "median_ratio": float(np.median(y / x)),
    }


def correlate(pool: ProcessPoolExecutor) -> None:
    """Compare both stiffnesses with frames over the designs of searches."""
    record: dict[str, object] = {"width": WIDTH, "provenance": provenance()}
    pictured = {}
    for name in PROBLEMS:
        masks = sampled(name)
        rows = list(pool.map(frame_of, [(name, mask, WIDTH, None) for mask in masks], chunksize=8))
        frame = np.array([row["frame"] for row in rows], dtype=np.float64)
        problem = find_problem(name)
        before = discrete(problem, masks)
        after = discrete(calibrated(problem, WIDTH), masks)
        for row, one, other in zip(rows, before, after, strict=True):
            row |= {"paper": one, "calibrated": other}
        figures = {"paper": agreement(before, frame), "calibrated": agreement(after, frame)}
        pictured[name] = (before, after, frame)
        record[name] = {
            **figures,
            "designs": len(rows),
            "not_stable_as_frames": sum(row["status"] != "converged" for row in rows),
            "touching_as_frames": sum(row["contacts"] > 0 for row in rows),
            "rows": [_plain(row) for row in rows],
        }
        for kind, one in figures.items():
            print(f"| {name} | {kind} | " + " | ".join(f"{value:.3g}" for value in one.values()))
    _write("correlation", record)
    _scatter(pictured)


def width_study(pool: ProcessPoolExecutor) -> None:
    """Fit the stiffness of joints to frames of several widths."""
    name = "crane"
    problem = find_problem(name)
    masks = sampled(name)[::4]
    record: dict[str, object] = {"provenance": provenance(), "joint": JOINT, "widths": {}}
    for width in WIDTHS:
        jobs = [(name, mask, width, None) for mask in masks]
        frame = np.array([row["frame"] for row in pool.map(frame_of, jobs, chunksize=4)])
        rows = {}
        for factor in FACTORS:
            angle = problem.stiffness.bond * factor * (width / 10.0) ** 2 / 6.0
            stiffness = Stiffness(problem.stiffness.bond, angle)
            rows[str(factor)] = agreement(
                discrete(replace(problem, stiffness=stiffness), masks), frame
            )
        best = max(rows, key=lambda factor: rows[factor]["determination"])
        paper = agreement(discrete(problem, masks), frame)
        record["widths"][str(width)] = {"best": best, "paper": paper, "factors": rows}  # type: ignore[index]
        chosen = rows[str(JOINT)]
        print(
            f"| {width} mm | {best} | {rows[best]['determination']:.3f} | "
            f"{chosen['determination']:.3f} | {paper['determination']:.3f} |"
        )
    _write("widths", record)


WAYS = {
    "paper": "the paper's stiffness",
    "calibrated": "that of the struts",
    "chosen": "that of the struts, ranked by frames",
}
"""How a part is searched for: the last as ``bellcrank design --strut-width`` does it."""


def searched(job: tuple[str, str, int]) -> dict[str, object]:
    """Search once, and look at what was found as a frame."""
    name, way, seed = job
    problem = find_problem(name)
    settings = read_settings(
        {"steps": 20_000, "seed": seed, "chains": 1, "goals": [f"no-contact {WIDTH / 10.0}"]}
    )
    if way == "chosen":
        found = designed(problem, settings)
    else:
        task = calibrated(problem, WIDTH) if way == "calibrated" else problem
        found = promising(task, settings)
    efficiency, mask = found
    return {"seed": seed, "promised": efficiency, **frame_of((name, mask, WIDTH, None))}


def designed(problem: Problem, settings: SearchSettings) -> tuple[float, str]:
    """Return efficiency and mask of what the whole job makes for the part."""
    with TemporaryDirectory() as place:
        folder = start_design(problem, settings, Path(place) / "run", PartSpec(width=WIDTH))
        report = complete_design(folder, workers=1)
    assert report is not None
    return report.selection.efficiency_after, report.selection.design.mask_hex


def promising(task: Problem, settings: SearchSettings) -> tuple[float, str]:
    """Return efficiency and mask of the best design of a chain in the model alone."""
    evaluator = make_evaluator(task, settings)
    state = start_chain(evaluator, settings, 0)
    best, mask = -np.inf, ""
    judge = SpringEvaluator(task)
    while state.step < settings.steps:
        state, rows = advance_chain(evaluator, settings, 0, state)
        for index in np.flatnonzero(rows.accepted & (rows.status == Status.CONVERGED)):
            if rows.efficiency[index] > best:
                bits = np.unpackbits(rows.mask[index])[: task.lattice.beam_count].astype(bool)
                cleaned = clean(Design(task, bits))
                response = judge.evaluate(cleaned.mask, VERIFICATION_INCREMENT)
                if response.status is Status.CONVERGED and response.efficiency > best:
                    best, mask = response.efficiency, pack_mask(cleaned.mask)
    return float(best), mask


def search_study(pool: ProcessPoolExecutor) -> None:
    """Compare what searches promise with what frames keep of it."""
    record: dict[str, object] = {"width": WIDTH, "provenance": provenance()}
    for name in PROBLEMS:
        for way, words in WAYS.items():
            rows = list(pool.map(searched, [(name, way, seed) for seed in range(SEEDS)]))
            kept = [row for row in rows if row["status"] == "converged"]
            promised = float(np.median([row["promised"] for row in kept]))
            frame = float(np.median([row["frame"] for row in kept]))
            off = float(np.median([abs(row["frame"] / row["promised"] - 1.0) for row in kept]))  # type: ignore[operator]
            touching = sum(bool(row["contacts"]) for row in kept)
            record[f"{name}, {way}"] = {
                "promised": promised, "frame": frame, "median_deviation": off,
                "not_stable_as_frames": len(rows) - len(kept), "touching_as_frames": touching,
                "rows": [_plain(r) for r in rows],
            }  # fmt: skip
            print(
                f"| {name} | {words} | {promised:.2f} | {frame:.2f} | {off:.0%} | "
                f"{len(rows) - len(kept)} of {len(rows)} | {touching} of {len(rows)} |"
            )
    _write("search", record)


def level_of(job: tuple[str, str, FemSettings]) -> dict[str, object]:
    """Analyse a design that comes with the package at a level."""
    what, level, settings = job
    design = find_design(what)
    validation = validate(design, replace_width(spec_for(design)), [(level, settings)])
    return {"design": what, **validation.to_dict(), **validation.analyses[0].to_dict()}


def replace_width(spec: PartSpec) -> PartSpec:
    """Return a part with struts of the width that all are compared at."""
    return spec.changed({"width": WIDTH})


def level_study(pool: ProcessPoolExecutor) -> None:
    """Validate the designs that come with the package, by all levels."""
    designs = [
        f"{kind}:{name}"
        for name in builtin
        for kind in ("human", "machine")
        if gallery_design(kind, name)  # type: ignore[arg-type]
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
    for what in designs:
        jobs = [(what, *column) for column in columns.values()]
        rows = dict(zip(columns, pool.map(level_of, jobs), strict=True))
        discrete_model = rows["frame, linear"]["discrete_model"]
        record[what] = {
            "discrete_model": discrete_model,
            **{name: _short(row) for name, row in rows.items()},
        }
        figures = [discrete_model["efficiency"], *(row["efficiency"] for row in rows.values())]  # type: ignore[index]
        words = " | ".join("-" if value is None else f"{value:.3f}" for value in figures)
        print(f"| {what} | {words} |", flush=True)
    _write("levels", record)


def mesh_of(size: float) -> dict[str, object]:
    """Analyse the full crane in the plane with triangles of a size, mm."""
    part = PartSpec(width=WIDTH).of(find_problem("crane").full_design())
    small = levels["plane"](part, FemSettings(size=size, linear=True))
    whole = levels["plane"](part, FemSettings(size=size))
    return {
        "size": size,
        "unknowns": whole.cost["unknowns"],
        "small_motions": small.efficiency,
        "efficiency": whole.efficiency,
        "force_N": float(np.hypot(*whole.last.force)),
    }


def mesh_study(pool: ProcessPoolExecutor) -> None:
    """Refine the mesh of the full crane."""
    rows = list(pool.map(mesh_of, SIZES))
    for row in rows:
        print("| " + " | ".join(f"{value:.6g}" for value in row.values()) + " |")
    _write("meshes", {"width": WIDTH, "rows": rows, "provenance": provenance()})


def _short(row: dict[str, object]) -> dict[str, object]:
    """Return what is worth keeping of an analysis."""
    kept = (
        "status", "reached", "loss_of_stability", "efficiency", "mean_output_displacement_mm",
        "input_force_N", "energy_N_mm", "von_mises_MPa", "principal_strain", "cost", "warnings",
    )  # fmt: skip
    return {key: row[key] for key in kept}


def _plain(row: dict[str, object]) -> dict[str, object]:
    """Round figures, and write what is none as null."""
    return {
        key: (round(value, 6) if np.isfinite(value) else None)
        if isinstance(value, float)
        else value
        for key, value in row.items()
    }


def _write(name: str, record: dict[str, object]) -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n")


def _scatter(pictured: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]) -> None:
    """Draw discrete model against frames, before and after."""
    figure = style.new_figure(9.0, 4.4)
    style.add_heading(
        figure,
        f"Discrete model against nonlinear frames, struts {WIDTH:g} mm wide on 10 mm",
        "each dot is a design that a search came by; on the line they agree",
        0.25,
        0.2,
    )
    for place, title in enumerate(("paper's stiffness", "stiffness of the struts")):
        axes = figure.add_axes((0.075 + 0.5 * place, 0.13, 0.40, 0.66))
        for (name, columns), colour in zip(
            pictured.items(), (style.OUTPUT, style.INPUT), strict=True
        ):
            figures = agreement(columns[place], columns[2])
            label = f"{name}: R² {figures['r_squared']:.3f}"
            axes.plot(
                columns[place], columns[2], linestyle="none", marker="o", markersize=3.0,
                color=colour, alpha=0.6, markeredgewidth=0.0, label=label,
            )  # fmt: skip
        everything = np.concatenate([np.concatenate(columns) for columns in pictured.values()])
        low, high = np.nanmin(everything), np.nanmax(everything)
        axes.plot([low, high], [low, high], color=style.IDLE, linewidth=1.0, zorder=1)
        words = {"family": style.FONT, "size": style.SMALL_SIZE, "color": style.INK}
        axes.set_xlabel(f"efficiency by the discrete model, {title}", **words)
        axes.set_ylabel("efficiency by nonlinear frames", **words)
        axes.tick_params(labelsize=style.SMALL_SIZE, colors=style.NOTE)
        axes.legend(frameon=False, prop={"family": style.FONT, "size": style.SMALL_SIZE})
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    save_figure(figure, FOLDER / "correlation.png", overwrite=True)


PARTS = {
    "correlate": correlate,
    "width": width_study,
    "search": search_study,
    "levels": level_study,
    "meshes": mesh_study,
}


def main() -> None:
    """Run the parts that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default=",".join(PARTS))
    chosen = parser.parse_args().only.split(",")
    with ProcessPoolExecutor(max_workers=2) as pool:
        for name in chosen:
            PARTS[name](pool)


if __name__ == "__main__":
    main()
