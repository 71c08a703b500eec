"""Tables of the record of benchmarks for the documentation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from reproduction.frame_benchmarks.definition import benchmarks
from reproduction.frame_benchmarks.study import KINDS, largest, percent

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

Row = tuple[str, ...]


def value_rows(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Yield benchmark, quantity, exact and published value, elements, and both results."""
    for name, row in figures["benchmarks"].items():
        for k, quantity in enumerate(row["quantities"]):
            published = [
                f"{each['values'][k]:.{each['digits']}f}"
                for each in row["published"]
                if each["elements"] is None
            ]
            cells = [
                f"{row[kind]['values'][-1][k]:.6g} ({percent(row[kind]['errors'][-1][k])})"
                for kind in KINDS
            ]
            yield (
                f"`{name}`", quantity,
                "-" if row["exact"] is None else f"{row['exact'][k]:.6g}",
                published[0] if published else "-", str(row["elements"][-1]), *cells,
            )  # fmt: skip


def convergence_rows(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Yield benchmark, elements, and the largest error of each kind of element with its order."""
    for name, row in figures["benchmarks"].items():
        for index, number in enumerate(row["elements"]):
            cells = []
            for kind in KINDS:
                errors = largest(row[kind]["errors"])
                order = ""
                if index and row["exact"] is not None and errors[index] > 1e-6:
                    order = f" ({math.log2(errors[index - 1] / errors[index]):.1f})"
                cells.append(f"{percent(errors[index])}{order}")
            yield f"`{name}`", str(number), *cells


def source_rows(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Yield sources with a number of elements: their figures and ours with as many elements."""
    for name, row in figures["benchmarks"].items():
        for each in row["published"]:
            if each["elements"] not in row["elements"]:
                continue
            index = row["elements"].index(each["elements"])
            published = ", ".join(f"{value:.{each['digits']}f}" for value in each["values"])
            cells = [
                ", ".join(f"{value:.{each['digits'] + 1}f}" for value in row[kind]["values"][index])
                for kind in KINDS
            ]
            exact = ", ".join(f"{value:.{each['digits'] + 1}f}" for value in row["exact"])
            yield f"`{name}`", each["source"], published, *cells, exact


def definition_lines() -> Iterator[str]:
    """Yield an item of a list for each benchmark: title, data, source and exact solution."""
    for name, each in benchmarks.items():
        text = f"- **`{name}`: {each.title}.** {each.data} Source: {each.source}."
        yield text + (f" Exact solution: {each.method}." if each.method else "")
