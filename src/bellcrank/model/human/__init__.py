"""Designs drawn by hand, the counterparts that a search must beat.

Each is a file ``NAME.json`` next to this one, named like its problem::

    {"schema": "bellcrank/human/1", "problem": "crane",
     "mechanism": "how it works, in a few sentences", "mask": "ffe0..."}

It refers to the built-in problem by name instead of embedding it, so that the
mask is read in the numbering of the code that ships it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from bellcrank.errors import InvalidFile
from bellcrank.model.builtin import builtin
from bellcrank.model.masks import unpack_mask
from bellcrank.model.parsing import Table, parse, read_json
from bellcrank.model.problem import Design

FOLDER = Path(__file__).parent


class HumanTable(Table):
    """A whole file of a human design."""

    schema_: Literal["bellcrank/human/1"] = Field(alias="schema")
    problem: str
    mechanism: str
    mask: str


def human_design(name: str) -> Design | None:
    """Return the design drawn by hand for a built-in problem, if there is one.

    Returns
    -------
    Design or None
        With ``provenance = {"kind": "human", "mechanism": ...}``.

    Raises
    ------
    InvalidFile
        If the file that ships with the package does not fit its problem.

    Examples
    --------
    >>> human_design("scaling-8") is None
    True
    """
    path = FOLDER / f"{name}.json"
    if name not in builtin or not path.is_file():
        return None
    table = parse(HumanTable, read_json(path), path.name)
    if table.problem != name:
        raise InvalidFile(f"{path.name}: problem: expected {name!r}, got {table.problem!r}")
    problem = builtin[name]()
    return Design(
        problem=problem,
        mask=unpack_mask(table.mask, problem.lattice.beam_count),
        provenance={"kind": "human", "mechanism": table.mechanism},
    )
