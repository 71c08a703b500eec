"""`bellcrank problems`: the bundled problems."""

from __future__ import annotations

from typing import Literal

from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.console import results

DRIVES = {"displacement": "motion", "force": "force"}


@app.command()
def problems() -> None:
    """List the bundled problems."""
    from bellcrank.model import builtin, find_problem, gallery_design

    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    headings = ("designable", "drive", "input", "output", "human", "machine")
    for name in ("problem", *headings):
        justify: Literal["left", "right"] = "right" if name == "designable" else "left"
        table.add_column(name, no_wrap=True, justify=justify)
    for name in builtin:
        problem = find_problem(name)
        table.add_row(
            name,
            f"{len(problem.designable)} of {problem.lattice.beam_count}",
            f"{DRIVES[problem.input.drive]} {problem.input.amount:.4g}",
            _direction(problem.input.direction.tolist()),
            _direction(problem.output.direction.tolist()),
            *("yes" if gallery_design(kind, name) else "" for kind in ("human", "machine")),
        )
    results.print(table)


def _direction(vectors: list[list[float]]) -> str:
    """Return the direction of all nodes as text, or ``several``."""
    first = vectors[0]
    if any(vector != first for vector in vectors):
        return "several"
    along = [round(value, 6) + 0.0 for value in first]
    for axis, value in zip("xyz", along, strict=False):
        if abs(value) == 1.0:
            return f"{'+' if value > 0.0 else '-'}{axis}"
    return f"({', '.join(f'{value:.3g}' for value in along)})"
