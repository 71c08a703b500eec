"""Tolerance of a design as a part: scenarios computed in processes, tables and plain data."""

from __future__ import annotations

import threading
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.results import finite
from bellcrank.model import Item, Tolerances
from bellcrank.part import PartSpec, frame_problem
from bellcrank.part.pieces import check_supported
from bellcrank.processes import FunctionProcesses, default_workers
from bellcrank.provenance import provenance
from bellcrank.search import specified
from bellcrank.task import NAMES, units_of
from bellcrank.tolerance import Deviations, Tolerance, evaluate_scenarios, scenarios_of
from bellcrank.workflows.specification import (
    dimension_of,
    item_label,
    number_text,
    shown_value,
    wanted_text,
)
from bellcrank.workflows.validation import problem_identity, spec_for

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bellcrank.model import Design, ObjectiveTerm
    from bellcrank.tolerance import Row, Scenario, ScenarioResult

SCHEMA = "bellcrank/tolerance/1"
IN_ONE_PROCESS = 50
"""Number of scenarios up to which one process computes all."""
CHUNK = 25
"""Number of results that a process sends at a time."""
HEADINGS = {
    "widths": "widths", "input": "direction", "stroke": "stroke", "print": "prints",
}  # fmt: skip
"""Headings of the worst values by kind of scenario. Lost struts are reported apart."""
WIDTH, NODE = 0.1, 0.1
"""Usual deviations of widths and of coordinates of nodes, mm."""
LOST = "lost"
"""Text for a value in a scenario without a stable path to the full stroke."""
MISSED = "\u00a0*"
"""End of a value that does not meet its item."""


@dataclass(frozen=True, slots=True, eq=False)
class ToleranceReport:
    """A design as a part, and its tolerance.

    Parameters
    ----------
    design
        Design of a frame, with a specification.
    spec
        Size and material of the part.
    deviations
        Sizes of the deviations.
    tolerance
        Scenarios and results.
    """

    design: Design
    spec: PartSpec
    deviations: Deviations
    tolerance: Tolerance

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, in the units of the part."""
        return {
            "schema": SCHEMA,
            "problem": self.design.problem.name,
            "problem_hash": problem_identity(self.design),
            "mask": self.design.mask_hex,
            "model": "frames",
            "elements": 1,
            "deviations": _deviation_data(self.deviations, self.spec),
            "scenarios": len(self.tolerance.scenarios),
            "yield": finite(self.tolerance.print_yield),
            "items": [self._row_data(row) for row in self.tolerance.rows()],
            "struts": [
                {"beam": beam, "lost": finite(loss), "stable": np.isfinite(loss).item()}
                for beam, loss in worst_struts(self.tolerance)
            ],
            "part": self.spec.to_dict(),
            "provenance": provenance(),
        }

    def _row_data(self, row: Row) -> dict[str, Any]:
        item = as_item(row.quantity)
        dimension = dimension_of(item)
        units = units_of(self.design.problem, self.spec)

        def number(value: float) -> float | None:
            return finite(units.in_part(dimension, value))

        return {
            "name": item.name,
            "objective": row.quantity is not item,
            "unit": NAMES[dimension],
            "nominal": number(row.nominal),
            "worst": {
                kind: {"value": number(worst.value), "scenario": worst.scenario.name}
                for kind, worst in row.worst.items()
            },
            "percentile_5": number(row.percentile),
            "yield": finite(row.share),
        }


def as_item(quantity: Item | ObjectiveTerm) -> Item:
    """Return an item, or one of the quantity of an objective."""
    if isinstance(quantity, Item):
        return quantity
    return Item(
        quantity=quantity.quantity, case=quantity.case, output=quantity.output, at_least=0.0
    )


def worst_struts(tolerance: Tolerance) -> list[tuple[int, float]]:
    """Return the struts with the part of the motion that their loss costs, worst first."""
    return sorted(tolerance.strut_losses().items(), key=lambda pair: -pair[1])


def tolerances_of(design: Design, spec: PartSpec) -> Tolerances:
    """Return the tolerances of the specification of a design; the usual ones if it has none."""
    wanted = design.problem.specification
    if wanted is not None and wanted.tolerances is not None:
        return wanted.tolerances
    return Tolerances(node=NODE / spec.scale)


def with_tolerances(design: Design, spec: PartSpec) -> Design:
    """Return a design whose specification has tolerances, the usual ones by default.

    One of springs is returned as it is.
    """
    if design.problem.section is None:
        return design
    problem = specified(design.problem, spec.registered_material.strain_limit)
    assert problem.specification is not None
    wanted = replace(problem.specification, tolerances=tolerances_of(design, spec))
    return replace(design, problem=replace(problem, specification=wanted))


def deviations_of(design: Design, spec: PartSpec, **changes: Any) -> Deviations:
    """Return the usual deviations of a design as a part, or those that its specification states.

    Parameters
    ----------
    **changes
        Fields of `bellcrank.tolerance.Deviations` with other values.
    """
    wanted = design.problem.specification
    usual: dict[str, Any] = {"tolerances": tolerances_of(design, spec)}
    if wanted is not None and wanted.tolerances is not None:
        usual |= {"width": 0.0, "thin": 0.0}
    else:
        usual["width"] = WIDTH / spec.scale
    return Deviations(**{**usual, **changes})


def _deviation_data(deviations: Deviations, spec: PartSpec) -> dict[str, Any]:
    """Return deviations as plain data, lengths in mm."""
    data = asdict(deviations)
    sizes = data.pop("tolerances")
    sizes = {**sizes, "relative_width": sizes.pop("width"), "node": spec.scale * sizes["node"]}
    return {**sizes, **data, "width": spec.scale * deviations.width}


def compute_tolerance(
    design: Design,
    deviations: Deviations | None = None,
    spec: PartSpec | None = None,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
    workers: int | None = None,
    stop: threading.Event | None = None,
) -> ToleranceReport | None:
    """Compute the tolerance of a design as a part.

    Parameters
    ----------
    design
        Design of a frame or of springs; with springs, its beams become the struts of the part.
    deviations
        Sizes of the deviations; `deviations_of` by default.
    spec
        Size and material of the part; that for which it was searched by default.
    progress
        Called with the number of scenarios that are computed, and of all.
    workers
        Number of processes; that of the cores by default.
    stop
        Event that ends the computation.

    Returns
    -------
    ToleranceReport or None
        None if the computation was stopped.

    Raises
    ------
    InvalidSettings
        If the part cannot be built, or has no stable path to its full stroke.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.tolerance import Deviations
    >>> few = Deviations(prints=4, struts=False)
    >>> report = compute_tolerance(human_design("crane"), few, workers=1)
    >>> report.tolerance.print_yield
    1.0
    """
    spec = spec or spec_for(design)
    deviations = deviations or deviations_of(design, spec)
    check_supported(design)
    limit = spec.registered_material.strain_limit
    problem = specified(frame_problem(design.problem, spec), limit)
    design = replace(design, problem=problem)
    scenarios = scenarios_of(problem, design.mask, deviations, spec.scale)
    results = _results(design, scenarios, progress, workers or default_workers(), stop)
    if len(results) < len(scenarios):
        return None
    assert problem.specification is not None
    ordered = [results[number] for number in range(len(scenarios))]
    tolerance = Tolerance(scenarios, ordered, problem.specification.maximise)
    return ToleranceReport(design, spec, deviations, tolerance)


def _results(
    design: Design,
    scenarios: Sequence[Scenario],
    progress: Callable[[int, int], None],
    workers: int,
    stop: threading.Event | None,
) -> dict[int, ScenarioResult]:
    """Return the results by number; fewer if the computation was stopped."""
    results: dict[int, ScenarioResult] = {}
    if workers == 1 or len(scenarios) <= IN_ONE_PROCESS:
        for number, result in enumerate(evaluate_scenarios(design, scenarios)):
            if stop is not None and stop.is_set():
                break
            results[number] = result
            progress(len(results), len(scenarios))
        return results
    jobs = [(design, scenarios[first::workers]) for first in range(workers)]
    waiting = [iter(range(first, len(scenarios), workers)) for first in range(workers)]

    def receive(job: int, value: list[ScenarioResult]) -> None:
        for result in value:
            results[next(waiting[job])] = result
        progress(len(results), len(scenarios))

    own = FunctionProcesses(__name__, send_results.__name__, jobs, receive)
    own.run(workers, stop or threading.Event())
    return results


def send_results(
    send: Callable[[object], None], design: Design, scenarios: Sequence[Scenario]
) -> None:
    """Compute scenarios and send their results, some at a time."""
    found = []
    for result in evaluate_scenarios(design, scenarios):
        found.append(result)
        if len(found) == CHUNK:
            send(found)
            found = []
    send(found)


def tolerance_rows(report: ToleranceReport) -> list[list[str]]:
    """Return the items and objectives as rows of texts, the first with the names of the columns.

    A worst value that does not meet its item ends with `MISSED`.
    """
    tolerance, problem = report.tolerance, report.design.problem
    units = units_of(problem, report.spec)
    kinds = [kind for kind in HEADINGS if kind in tolerance.kinds]
    has_prints = "print" in kinds
    head = ["item", "wanted", "drawn", *(HEADINGS[kind] for kind in kinds)]
    rows = [head + ["95 %", "yield"] * has_prints]
    for row in tolerance.rows():
        item = as_item(row.quantity)
        wanted = wanted_text(item, units) if row.quantity is item else "maximise"

        def text(value: float, item: Item = item) -> str:
            return LOST if np.isnan(value) else number_text(item, shown_value(item, value), units)

        worst = [(kind, row.worst[kind]) for kind in kinds]
        found = [
            # Items are wanted at the full stroke, not at half of it.
            text(each.value) + (MISSED if not each.met and kind != "stroke" else "")
            for kind, each in worst
        ]
        cells = [item_label(item, problem), wanted, text(row.nominal), *found]
        if has_prints:
            share = "" if np.isnan(row.share) else f"{100.0 * row.share:.0f} %"
            cells += [text(row.percentile), share]
        rows.append(cells)
    return rows


def tolerance_sentence(report: ToleranceReport) -> str:
    """Return the number of scenarios, the model, and how many random prints meet all items."""
    tolerance = report.tolerance
    sentence = (
        f"{len(tolerance.scenarios)} scenarios, by frames with one element in each strut; the "
        "worst value of each kind, with * if it does not meet its item (at other strokes, items do "
        f"not count), '{LOST}' if the part is not stable up to the full stroke or cannot be made"
    )
    if prints := tolerance.of_kind("print"):
        met = sum(tolerance.results[number].met for number in prints)
        sizes = report.deviations.tolerances
        sentence += (
            f"; {met} of {len(prints)} random prints {met_words(report)}: widths up to "
            f"{100.0 * sizes.width:g}% off, each with a standard deviation of "
            f"{100.0 * sizes.each_width:g}%, "
            f"nodes up to {report.spec.scale * sizes.node:.2g} mm off, inputs turned by up to "
            f"{sizes.angle:g} degrees"
        )
        if not sizes.keep and (causes := _causes(report)):
            sentence += f"; {causes}"
    return sentence


def _causes(report: ToleranceReport) -> str:
    """Return what random prints miss, and what a turned input alone misses; empty if nothing."""
    tolerance, problem = report.tolerance, report.design.problem
    prints = tolerance.of_kind("print")
    lost = sum(not tolerance.results[number].is_stable for number in prints)
    missed = [f"{LOST}: {lost}"] if lost else []
    rows = [(row.quantity, row) for row in tolerance.rows() if isinstance(row.quantity, Item)]
    for item, row in rows:
        if count := round((1.0 - row.share) * len(prints)) - lost:
            missed.append(f"{item_label(item, problem)}: {count}")
    found = [f"prints that miss items: {', '.join(missed)}"] if missed else []
    turned = [item for item, row in rows if "input" in row.worst and not row.worst["input"].met]
    if turned:
        names = ", ".join(item_label(item, problem) for item in turned)
        found.append(f"with an input turned as far, a part as drawn misses {names}, too")
    return "; ".join(found)


def deviation_words(deviations: Deviations) -> str:
    """Return the scenarios besides prints and lost struts in words."""
    sizes = deviations.tolerances
    thin = max(sizes.width, deviations.thin)
    return (
        f"widths {thin:.0%} narrower to {sizes.width:.0%} wider, input directions "
        f"{sizes.angle:g}\u00b0 off, and {deviations.shortest:g} and {deviations.longest:g} strokes"
    )


def met_words(report: ToleranceReport) -> str:
    """Return what random prints are to do, as a verb with its object."""
    keep = report.deviations.tolerances.keep
    return f"keep {keep:.0%} of the efficiency" if keep else "meet all items"


def scenario_rows(report: ToleranceReport) -> list[list[str]]:
    """Return the scenarios that are worst for the first objective, or else the first item."""
    rows = report.tolerance.rows()
    chosen = next((row for row in rows if not isinstance(row.quantity, Item)), rows[0])
    return [
        [f"worst, {HEADINGS[kind]}", worst.scenario.name]
        for kind, worst in chosen.worst.items()
        if kind in HEADINGS
    ]


def strut_lines(report: ToleranceReport, count: int) -> list[str]:
    """Return sentences on the struts whose loss costs most."""
    losses = worst_struts(report.tolerance)
    if not losses:
        return []
    lost = [beam for beam, loss in losses if np.isinf(loss)]
    reversed_ = [beam for beam, loss in losses if 1.0 < loss < np.inf]
    half = [beam for beam, loss in losses if 0.5 < loss <= 1.0]
    lines = [
        f"{len(lost)} of {len(losses)} struts are needed to reach the full stroke",
        f"without one of {len(reversed_)} others the motion is reversed",
        f"without one of {len(half)} others more than half of it is lost",
    ]
    others = [(beam, loss) for beam, loss in losses if np.isfinite(loss)][:count]
    if others:
        cost = ", ".join(f"{beam} ({100.0 * loss:.0f} %)" for beam, loss in others)
        measure = report.tolerance.measure
        lines.append(f"parts of the {measure} that the loss of other struts costs: {cost}")
    return lines
