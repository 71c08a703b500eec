"""Items of a specification as the page lists them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from bellcrank.fem.results import finite
from bellcrank.model import CARRIED
from bellcrank.task import units_of
from bellcrank.workflows.specification import item_label, number_text, shown_value, wanted_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Item, Problem
    from bellcrank.part import PartSpec
    from bellcrank.search import SpecificationEvaluator
    from bellcrank.task import ProblemUnits


def wanted_items(problem: Problem, part: PartSpec) -> list[dict[str, str]]:
    """Return name, label and bounds of the items of a specification, then its objectives.

    Empty without a specification. The names of objectives begin with ``maximise:``. The last one
    is ``tolerance``, if there are tolerances.
    """
    wanted = problem.specification
    if wanted is None:
        return []
    units = units_of(problem, part)
    items = [_texts(item, problem, units) for item in wanted.items]
    for each in wanted.maximise:
        size = "large" if each.scale > 0.0 else "small"
        items.append(
            {
                "name": f"maximise:{each.item.name}",
                "label": item_label(each.item, problem),
                "wanted": f"as {size} as possible",
            }
        )
    prints = wanted_of_prints(problem)
    if prints is not None:
        items.append(prints)
    return items


def wanted_of_prints(problem: Problem) -> dict[str, str] | None:
    """Return what a specification wants of random prints; None without tolerances."""
    wanted = problem.specification
    if wanted is None or wanted.tolerances is None:
        return None
    share, keep = wanted.tolerances.least_yield, wanted.tolerances.keep
    found = f"keep {keep:.0%} of the gain" if keep else "meet all items"
    return {"name": "tolerance", "label": "random prints", "wanted": f"{share:.0%} {found}"}


def objective_states(
    problem: Problem, part: PartSpec, evaluator: SpecificationEvaluator
) -> list[dict[str, str]]:
    """Return quantity, label and value of what is maximised, of the design evaluated last."""
    units = units_of(problem, part)
    return [
        {
            "quantity": each.item.quantity,
            "label": item_label(each.item, problem),
            "reached": number_text(each.item, shown_value(each.item, each.value), units),
        }
        for each in evaluator.objective_results()
    ]


def item_states(
    problem: Problem, part: PartSpec, results: Sequence[ItemResult]
) -> list[dict[str, Any]]:
    """Return the items that a design reaches in one model."""
    units = units_of(problem, part)
    states = []
    for each in results:
        value = shown_value(each.item, each.value)
        states.append(
            {
                **_texts(each.item, problem, units),
                "reached": number_text(each.item, value, units),
                "margin": finite(each.margin) if math.isfinite(value) else None,
                "met": bool(each.met),
            }
        )
    return states


def _texts(item: Item, problem: Problem, units: ProblemUnits) -> dict[str, str]:
    """Return name, label and bounds of an item."""
    halved = ", halves the motion" if item.quantity in CARRIED else ""
    return {
        "name": item.name,
        "label": item_label(item, problem),
        "wanted": wanted_text(item, units) + halved,
    }
