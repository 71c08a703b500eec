"""Items of a specification in the units of the part: wanted, reached, margin, met."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bellcrank.fem.results import finite
from bellcrank.mechanics import VERIFICATION_INCREMENT
from bellcrank.model import CARRIED, QUANTITIES
from bellcrank.part.units import GRAVITY
from bellcrank.search import SpecificationEvaluator
from bellcrank.task import NAMES, units_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Item, Problem
    from bellcrank.model.specification import Dimension
    from bellcrank.part import PartSpec
    from bellcrank.task import ProblemUnits

ROUNDING = 1e-9
"""Size below which a number is written as 0: rounding of symmetric designs."""

UNSTABLE = "unstable"
"""Text for a value that does not exist, since the part is not stable up to the full stroke."""
LABELS = {
    "off_axis": "off-axis motion", "path_error": "path error", "blocked_force": "blocked force",
    "input_force": "input force", "stable_stroke": "stable stroke",
    "strut_loss": "strut loss", "dead_load": "dead load",
}  # fmt: skip
"""Names of quantities whose words differ from their keys."""


def item_label(item: Item, problem: Problem) -> str:
    """Return the name of an item: case and output where there are several, and the quantity.

    Examples
    --------
    >>> from bellcrank.task import find_task
    >>> problem = find_task("selector").problem
    >>> item_label(problem.specification.items[0], problem)
    'A: gain'
    """
    wanted = problem.specification
    assert wanted is not None
    outputs = wanted.output_names(item.case) if item.case else ()
    parts = [item.case] if len(wanted.case_names) > 1 and item.case else []
    parts += [item.output] if len(outputs) > 1 and item.output else []
    name = LABELS.get(item.quantity, item.quantity)
    return f"{', '.join(parts)}: {name}" if parts else name


def number_text(item: Item, value: float, units: ProblemUnits) -> str:
    """Return a value of the quantity of an item with its unit; a load as a mass, too.

    An infinite value is one above the lower bound, which is not always determined; an unknown one
    means that the motion under the load of the item is not stable.

    Examples
    --------
    >>> from bellcrank.model import Item
    >>> from bellcrank.task import ProblemUnits
    >>> units = ProblemUnits(length=10.0, force=12.0)
    >>> number_text(Item(quantity="off_axis", at_most=0.1), 0.0321, units)
    '3.21 %'
    >>> number_text(Item(quantity="dead_load", at_least=0.01), float("nan"), units)
    'unstable'
    """
    if value == math.inf and item.at_least is not None:
        sign = "at least" if item.quantity == "stable_stroke" else ">"
        return f"{sign} {number_text(item, item.at_least, units)}"
    if value == math.inf:
        return "more"
    if not math.isfinite(value):
        return UNSTABLE
    unit = _unit(item)
    number = 100.0 * value if unit == "%" else value
    number = units.in_part(dimension_of(item), number)
    if abs(number) < ROUNDING:
        number = 0.0
    mass = f" ({1e3 * number / GRAVITY:.3g} g)" if item.quantity in CARRIED else ""
    return f"{number:.3g} {unit}".rstrip() + mass


def wanted_text(item: Item, units: ProblemUnits) -> str:
    """Return the bounds of an item as text.

    Examples
    --------
    >>> from bellcrank.model import Item
    >>> from bellcrank.task import ProblemUnits
    >>> units = ProblemUnits(length=10.0, force=12.0)
    >>> wanted_text(Item(quantity="travel", at_least=-0.05, at_most=0.05, start=0, stop=0.5), units)
    '-0.5 to 0.5 mm, up to 50 % of the stroke'
    """
    low, high = item.at_least, item.at_most
    if low is not None and high is not None:
        first = number_text(item, low, units).removesuffix(f" {_unit(item)}")
        text = f"{first} to {number_text(item, high, units)}"
    elif high is not None:
        text = f"at most {number_text(item, high, units)}"
    else:
        assert low is not None
        text = f"at least {number_text(item, low, units)}"
    if item.of != "every":
        text = f"{item.of} {text}"
    if not QUANTITIES[item.quantity].along or item.quantity == "strain":
        return text
    start, stop = f"{100.0 * item.start:.3g}", f"{100.0 * item.stop:.3g}"
    if item.start == item.stop == 1.0:
        return text
    if item.start == 0.0 and item.stop == 1.0:
        return f"{text}, along the stroke"
    if item.start == 0.0:
        return f"{text}, up to {stop} % of the stroke"
    return f"{text}, from {start} to {stop} % of the stroke"


def dimension_of(item: Item) -> Dimension:
    """Return the dimension of the values of an item."""
    return "ratio" if item.of == "spread" else QUANTITIES[item.quantity].dimension


def _unit(item: Item) -> str:
    """Return the unit in which the values of an item are written."""
    dimension = QUANTITIES[item.quantity].dimension
    if item.of == "spread" or (dimension == "ratio" and item.quantity != "gain"):
        return "%"
    return NAMES[dimension]


def item_rows(
    problem: Problem,
    spec: PartSpec,
    results: Mapping[str, Sequence[ItemResult]],
    decisive: str | None = None,
) -> list[list[str]]:
    """Return the items as rows of texts, the first one with the names of the columns.

    Parameters
    ----------
    problem
        Problem with a specification.
    spec
        Size and material of the part.
    results
        Items by model.
    decisive
        The model whose margins are shown and that determines whether an item is met; the last by
        default. In others, missed items are marked.
    """
    units = units_of(problem, spec)
    rows = [["item", "wanted", *results, "margin", "met"]]
    columns = list(results.values())
    chosen = len(columns) - 1 if decisive is None else list(results).index(decisive)
    for values in zip(*columns, strict=True):
        item, last = values[0].item, values[chosen]
        is_known = math.isfinite(shown_value(item, last.value))
        after = [" (NO)" if k > chosen and not each.met else "" for k, each in enumerate(values)]
        rows.append(
            [
                item_label(item, problem),
                wanted_text(item, units),
                *(
                    number_text(item, shown_value(item, each.value), units) + mark
                    for each, mark in zip(values, after, strict=True)
                ),
                f"{100.0 * last.margin:+.0f} %" if is_known else "-",
                "yes" if last.met else "NO",
            ]
        )
    return rows


def shown_value(item: Item, value: float) -> float:
    """Return the value of an item; infinite for more than a wanted load, or a stable stroke.

    A load is extrapolated from the motion under the wanted one, and larger ones may be carried less
    well. A stroke is followed up to the wanted part of it.
    """
    if item.quantity == "stable_stroke" and item.at_least is not None:
        return math.inf if value >= item.at_least else value
    least = item.at_least if item.quantity in CARRIED else None
    return value if least is None or not value > least else math.inf


def item_data(
    problem: Problem, spec: PartSpec, results: Mapping[str, Sequence[ItemResult]]
) -> list[dict[str, Any]]:
    """Return the items as plain data, in the units of the part (`bellcrank.task.NAMES`).

    Parameters
    ----------
    problem, spec, results
        As in `item_rows`.
    """
    units = units_of(problem, spec)
    rows = []
    for values in zip(*results.values(), strict=True):
        item = values[0].item
        dimension = dimension_of(item)
        data = item.to_dict()
        data.pop("path", None)
        for key in ("at_least", "at_most"):
            if key in data:
                data[key] = units.in_part(dimension, data[key])
        reached = {
            model: {
                "value": finite(units.in_part(dimension, each.value)),
                "margin": finite(each.margin),
                "violation": each.violation,
                "met": each.met,
            }
            for model, each in zip(results, values, strict=True)
        }
        rows.append({"name": item.name, **data, "unit": NAMES[dimension], "reached": reached})
    return rows


def results_for(
    problem: Problem, mask: NDArray[np.bool_], elements: int | None = None
) -> list[ItemResult] | None:
    """Return the items that a design reaches as a frame, from rest in small increments.

    Parameters
    ----------
    problem
        Any problem; None is returned for one without a specification.
    mask : (M,) bool
        The design.
    elements : int, optional
        As in `bellcrank.mechanics.FrameEvaluator`.

    Returns
    -------
    list of ItemResult or None
        None also for a design without a stable path to the full stroke.
    """
    evaluator = evaluated(problem, mask, elements)
    return None if evaluator is None else evaluator.results()


def evaluated(
    problem: Problem, mask: NDArray[np.bool_], elements: int | None = None
) -> SpecificationEvaluator | None:
    """Return the evaluator of a specification with the results of a design.

    Parameters, and where there is None, are those of `results_for`.
    """
    if not problem.is_specified:
        return None
    assert problem.specification is not None
    # The design itself counts, not the symmetric one that a search would make of it.
    wanted = replace(problem.specification, symmetry=())
    evaluator = SpecificationEvaluator(replace(problem, specification=wanted), elements)
    response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
    return evaluator if response.is_admissible else None


def binding(results: Sequence[ItemResult]) -> list[ItemResult]:
    """Return the items that are not met, the one that is farthest from being met first."""
    missed = [each for each in results if not each.met]
    return sorted(missed, key=lambda each: -each.violation)
