"""Items of a specification as the page lists them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from bellcrank.fem.results import finite
from bellcrank.model import Item
from bellcrank.task import units_of
from bellcrank.workflows.specification import item_label, number_text, shown_value, wanted_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Problem
    from bellcrank.part import PartSpec
    from bellcrank.task import ProblemUnits


def wanted_items(problem: Problem, part: PartSpec) -> list[dict[str, str]]:
    """Return name, label and bounds of the items of a specification, then its objectives.

    Empty without a specification. The names of objectives begin with ``maximise:``.
    """
    wanted = problem.specification
    if wanted is None:
        return []
    units = units_of(problem, part)
    items = [_texts(item, problem, units) for item in wanted.items]
    for each in wanted.maximise:
        item = Item(quantity=each.quantity, case=each.case, output=each.output, at_least=0.0)
        size = "large" if each.scale > 0.0 else "small"
        items.append(
            {
                "name": f"maximise:{item.name}",
                "label": item_label(item, problem),
                "wanted": f"as {size} as possible",
            }
        )
    return items


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
    return {
        "name": item.name,
        "label": item_label(item, problem),
        "wanted": wanted_text(item, units),
    }
