"""What refinement gains: ``python -m benchmarks.refinement``.

Three comparisons, by frames with eight elements in each strut and in the sheet, and a cost:

- ``mass``: the bundled parts, and designs searched for the largest gain in the 24 directions and
  sizes of the library, refined at equal mass, equal least width and without contact; gain before
  and after.
- ``straight``: crane and anti-parallel with an off-axis motion of at most 2 % and a rotation of at
  most 2 degrees, from the bundled design and from searches with several seeds, refined by frames;
  the results are then computed in the sheet. With ``straight-sheet``, searches are refined in the
  sheet too, as by `bellcrank design`.
- ``exact``: the slider with a gain of 3.0 within 0.1 %, an off-axis motion below 1 % and a rotation
  below 0.5 degrees, from searches with several seeds.
- ``cost``: the time of the derivatives of all channels by the geometry, over that of the channels
  and their responses, in the plane and in space.

Each run is added to ``docs/refinement/runs.json`` as soon as it is done; runs that are in the
record are not repeated. Times are those of one core. ``--only mass`` makes one comparison.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings, NoDesignFound
from bellcrank.fem.continuum.mesh import COARSE
from bellcrank.fem.specification import sheet_items
from bellcrank.machines.elementary import DIRECTIONS
from bellcrank.machines.library.tasks import EntryTask
from bellcrank.mechanics.frames.case import CHANNELS, LOADED, CaseEvaluator, Channel
from bellcrank.mechanics.frames.geometry import BeamSlopes, beam_slopes, geometry_slopes
from bellcrank.model import Design, Item, gallery_design
from bellcrank.part import PartSpec, models
from bellcrank.refine import RefinementSettings, refine_design
from bellcrank.search import read_settings, specified
from bellcrank.task import find_task
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.refinement import BEFORE_REFINEMENT
from bellcrank.workflows.refiners import EVALUATIONS, sheet_of
from bellcrank.workflows.specification import binding

from .frames import diluted, octet
from .record import add_runs
from .tasks import CORES, core_seconds

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Problem
    from bellcrank.refine.differences import Records

RECORD = Path(__file__).parents[1] / "docs" / "refinement" / "runs.json"
PARTS = ("crane", "anti-parallel", "discs", "pliers", "scaling-8")
SEEDS = 8
"""Number of searches of each straight or exact motion."""
STRAIGHT_CHAINS = 4
"""Number of chains of the searches for a straight motion."""
SHARED = {"input_motion", "input_force", "strain"}
"""Channels that belong to a case, not to an output."""
QUARTERS = [0.25, 0.5, 0.75, 1.0]
REPEATS = 5
BUNDLED = "bundled"
"""In place of a seed: from the bundled design."""


def cost_of_gradients(kind: str) -> dict[str, Any]:
    """Return the time of all derivatives over that of the channels, medians of random designs."""
    if kind == "plane":
        crane = gallery_design("machine", "crane")
        assert crane is not None
        problem = models["frames"](crane.problem, PartSpec())
    else:
        problem = octet(2)
    given = problem.input
    problem = replace(problem, input=replace(given, amount=0.3 * given.amount))
    weight = np.zeros(problem.lattice.dimension)
    weight[-1] = -1e-3
    ratios = []
    for seed in range(SEEDS):
        mask = diluted(problem, seed)
        forces = dict.fromkeys((Channel(name, "output") for name in LOADED), 1e-4)
        case = CaseEvaluator(problem, None, weight, forces)
        ratios.append(min(_cost(case, mask) for _ in range(REPEATS)))
    return {"met": max(ratios) <= 2.0, "beams": problem.lattice.beam_count, "cost": median(ratios)}


def _cost(case: CaseEvaluator, mask: NDArray[np.bool_]) -> float:
    started = time.perf_counter()
    case.respond(mask)
    channels = [Channel(name, "" if name in SHARED else "output") for name in CHANNELS]
    case.values(channels, QUARTERS)
    computed = time.perf_counter()
    slopes: dict[int, BeamSlopes] = {}
    for point in case.merged_points():
        own = id(point.evaluator)
        slopes[own] = slopes.get(own) or beam_slopes(point.evaluator, mask)
        geometry_slopes(point.equilibrium, point.measured, slopes[own])
    return (time.perf_counter() - computed) / (computed - started)


def bundled_part(name: str) -> Design:
    """Return a bundled part."""
    design = gallery_design("machine", name)
    assert design is not None
    return design


def searched_actuator(direction: str, columns: int) -> Design:
    """Search for the largest gain in a direction and size of the library."""
    problem = replace(EntryTask(direction, columns, "straight-10g").problem(), specification=None)
    settings = read_settings({"steps": 3_000, "chains": CORES})
    with TemporaryDirectory() as temporary:
        folder = start_design(problem, settings, Path(temporary) / "run", PartSpec())
        report = complete_design(folder, workers=CORES)
    assert report is not None
    return report.selection.design


def at_equal_mass(design: Design) -> dict[str, Any]:
    """Refine a design for its gain."""
    spec = PartSpec()
    problem = specified(
        models["frames"](design.problem, spec), spec.registered_material.strain_limit
    )
    wanted = problem.specification
    assert wanted is not None
    (largest,) = wanted.maximise
    item = Item(quantity=largest.quantity, case=largest.case, output=largest.output, at_least=0.0)
    problem = replace(problem, specification=replace(wanted, items=(*wanted.items, item)))
    given = Design(problem, design.mask)
    settings = RefinementSettings(evaluations=EVALUATIONS, same_mass=True)
    in_sheet, sheet_seconds = sheet_of(spec, given), 0.0

    def sheet(design: Design) -> Records | None:
        nonlocal sheet_seconds
        assert in_sheet is not None
        used = core_seconds()
        records = in_sheet(design)
        sheet_seconds += core_seconds() - used
        return records

    used = core_seconds()
    found = refine_design(given, settings, sheet=sheet)
    row = {
        "seconds": round(core_seconds() - used - sheet_seconds, 1),
        "sheet_seconds": round(sheet_seconds, 1),
        "sheets": found.sheets,
        "quantity": item.quantity,
        "gain_before": found.before.objective,
        "gain": found.after.objective,
        "met_before": found.before.met,
        "met": found.after.met,
        "reason": found.reason,
    }
    for key, each in (("sheet_before", given), ("sheet", found.design)):
        value = _value(_in_sheet(spec, each) or (), item.quantity)
        row[f"gain_{key}"] = None if value is None else value / largest.scale
    return row


def straight_problem(problem: Problem) -> Problem:
    """Return a problem of a straight motion with tighter bounds, for a free output."""
    return _bounded(
        problem, {"off_axis": (None, 0.02), "rotation": (-2.0, 2.0)}, dropped={"payload", "sag"}
    )


def exact_problem(problem: Problem) -> Problem:
    """Return the slider with a given gain in place of the largest one."""
    bounds = {"gain": (2.997, 3.003), "off_axis": (None, 0.01), "rotation": (-0.5, 0.5)}
    exact = _bounded(problem, bounds, dropped=set())
    assert exact.specification is not None
    return replace(exact, specification=replace(exact.specification, maximise=()))


def _bounded(
    problem: Problem, bounds: dict[str, tuple[float | None, float]], dropped: set[str]
) -> Problem:
    """Return a problem with other bounds of its items, and without some of them."""
    wanted = problem.specification
    assert wanted is not None
    items = []
    for item in wanted.items:
        low, high = bounds.get(item.quantity, (item.at_least, item.at_most))
        if item.quantity not in dropped:
            items.append(replace(item, at_least=low, at_most=high))
    return replace(problem, specification=replace(wanted, items=tuple(items)))


def from_bundled(task: str, problem: Problem, spec: PartSpec) -> dict[str, Any]:
    """Refine the bundled design of a problem to a specification, by frames."""
    design = gallery_design("machine", task.removeprefix("straight-"))
    assert design is not None
    used = core_seconds()
    settings = RefinementSettings(evaluations=EVALUATIONS)
    found = refine_design(Design(problem, design.mask), settings)
    return {
        "seconds": round(core_seconds() - used, 1),
        "gain": found.after.objective,
        "met": found.after.met,
        **_values(found.after.items, "frame"),
        "reason": found.reason,
        **_after_refinement(spec, found.design),
    }


def from_search_by_frames(
    problem: Problem, spec: PartSpec, seed: int, chains: int
) -> dict[str, Any]:
    """Search and refine a design with a seed, by frames; compute the result in the sheet."""
    found: list[Design] = []
    row = from_search(problem, None, seed, chains, found)
    return {**row, **_after_refinement(spec, found[0])} if found else row


def _after_refinement(spec: PartSpec, design: Design) -> dict[str, Any]:
    """Return the figures in the sheet of a design that was refined by frames."""
    sheet = _in_sheet(spec, design)
    return {
        "met_in_sheet": sheet is not None and not binding(sheet),
        **_values(sheet or (), "sheet"),
    }


def from_search(
    problem: Problem,
    spec: PartSpec | None,
    seed: int,
    chains: int = CORES,
    found: list[Design] | None = None,
) -> dict[str, Any]:
    """Search and refine a design with a seed; add it to a list.

    Without a part it is refined by frames only.
    """
    used = core_seconds()
    with TemporaryDirectory() as temporary:
        settings = read_settings({**BEFORE_REFINEMENT, "seed": seed, "chains": chains})
        folder = start_design(problem, settings, Path(temporary) / "run", spec)
        try:
            report = complete_design(folder, workers=CORES)
        except NoDesignFound as error:
            return {"met": False, "error": str(error)}
    assert report is not None
    assert report.refinement is not None
    after = report.refinement.after
    if found is not None:
        found.append(report.selection.design)
    return {
        "seconds": round(core_seconds() - used, 1),
        "gain_before": report.refinement.before.objective,
        "gain": after.objective,
        "met": after.met,
        "met_in_sheet": bool(after.met_in_sheet),
        **_values(report.refinement.before.items, "before"),
        **_values(after.items, "frame"),
        **_values(after.sheet, "sheet"),
        "reason": report.refinement.reason,
    }


def _in_sheet(spec: PartSpec, design: Design) -> Sequence[ItemResult] | None:
    try:
        return sheet_items(spec.of(design), fineness=COARSE)
    except InvalidSettings:
        return None


def _value(items: Sequence[ItemResult], quantity: str) -> float | None:
    """Return the value of an item; None if there is none."""
    return next((each.value for each in items if each.item.quantity == quantity), None)


def _values(items: Sequence[ItemResult], model: str) -> dict[str, float]:
    """Return the values of all items, with the model after the name."""
    return {f"{each.item.quantity}_{model}": each.value for each in items}


def runs() -> dict[str, Callable[[], dict[str, Any]]]:
    """Return all runs by name."""
    out: dict[str, Callable[[], dict[str, Any]]] = {
        f"cost {kind}": lambda kind=kind: cost_of_gradients(kind) for kind in ("plane", "space")
    }
    for name in PARTS:
        out[f"mass {name}"] = lambda name=name: at_equal_mass(bundled_part(name))
    for direction, columns in product(DIRECTIONS, (7, 9, 12)):
        out[f"mass {direction}-{columns}"] = lambda direction=direction, columns=columns: (
            at_equal_mass(searched_actuator(direction, columns))
        )
    cases = [("straight-crane", straight_problem), ("straight-anti-parallel", straight_problem)]
    for seed in (BUNDLED, *range(SEEDS)):
        for name, changed in (*cases, ("slider", exact_problem)):
            task = find_task(name)
            assert task is not None
            problem, spec = changed(task.problem), task.part
            if name == "slider":
                kinds = {"exact": (from_search, CORES)} if isinstance(seed, int) else {}
            elif isinstance(seed, int):
                kinds = {
                    "straight": (from_search_by_frames, STRAIGHT_CHAINS),
                    "straight-sheet": (from_search, STRAIGHT_CHAINS),
                }
            else:
                out[f"straight {name} {seed}"] = partial(from_bundled, name, problem, spec)
                kinds = {}
            for kind, (job, chains) in kinds.items():
                out[f"{kind} {name} {seed}"] = partial(job, problem, spec, seed, chains)
    return out


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="first words of the names of runs")
    given = parser.parse_args()
    rows = add_runs(RECORD, runs(), given.only)
    for line in summary(rows):
        print(line)


def summary(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return the rows of the tables, and the medians at equal mass."""
    lines = [f"{name}: {row['cost']:.2f}" for name, row in rows.items() if "cost" in row]
    mass = {name: row for name, row in rows.items() if name.startswith("mass")}
    if mass:
        lines += [*mass_rows(mass), growth(mass)]
    return [*lines, *specified_rows(rows)]


def mass_rows(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return a row for each design at equal mass.

    Gain before and after by frames of 8 elements, before and after in the sheet, and the times in s
    of the refinement and of the sheets.
    """
    return [
        f"| {name.partition(' ')[2]} | {row['gain_before']:.2f} | {row['gain']:.2f} "
        f"| {_two(row['gain_sheet_before'])} | {_two(row['gain_sheet'])} "
        f"| {row['seconds']:.0f} s | {row['sheet_seconds']:.0f} s |"
        for name, row in sorted(rows.items())
        if name.startswith("mass")
    ]


def _two(value: float | None) -> str:
    return "not stable" if value is None else f"{value:.2f}"


def growth(rows: dict[str, dict[str, Any]]) -> str:
    """Return the median growth of the gain at equal mass, by frames and in the sheet, as text.

    Designs whose sheet is not stable after the refinement count as not grown.
    """
    frames, sheet = [], []
    for row in rows.values():
        frames.append(row["gain"] / row["gain_before"] - 1.0)
        known = row["gain_sheet"] and row["gain_sheet_before"]
        sheet.append(row["gain_sheet"] / row["gain_sheet_before"] - 1.0 if known else 0.0)
    return (
        f"{len(rows)} designs: {median(frames):.0%} by frames, {median(sheet):.0%} in the sheet "
        f"(medians); {median(row['seconds'] for row in rows.values()):.0f} s"
    )


def specified_rows(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return a row for each specification.

    Runs that meet it by frames of 8 elements, and in the sheet; medians of the gain, of the largest
    off-axis motion and rotation, by frames of 8 elements; the median time in s of one core.
    """
    lines = []
    kinds = {"straight", "straight-sheet", "exact"}
    names = {name.rpartition(" ")[0] for name in rows if name.split()[0] in kinds}
    for kind in sorted(names):
        own = [row for name, row in rows.items() if name.rpartition(" ")[0] == kind]
        lines.append(
            f"| {kind} | {sum(row['met'] for row in own)} of {len(own)} "
            f"| {sum(bool(row.get('met_in_sheet')) for row in own)} of {len(own)} "
            f"| {_median(own, 'gain', '.3g')} | {_median(own, 'off_axis_frame', '.1%')} "
            f"| {_median(own, 'rotation_frame', '.2g')} "
            f"| {_median(own, 'seconds', '.0f')} s |"
        )
    return lines


def _median(rows: list[dict[str, Any]], key: str, style: str) -> str:
    """Return the median of a figure (of a rotation, its size) as text; a dash if not known."""
    values = [row[key] for row in rows if row.get(key) is not None]
    if key.startswith("rotation"):
        values = list(map(abs, values))
    return format(median(values), style).replace("%", " %") if values else "-"


if __name__ == "__main__":
    main()
