"""Bundled designs: drawn by hand, and found by searches for the same problems.

Each is a file ``human/NAME.json`` or ``machine/NAME.json`` in this folder, where NAME is the
bundled problem::

    {"schema": "bellcrank/gallery/1", "problem": "crane",
     "origin": "how it works or was found, in a few sentences", "mask": "ffe0..."}

The file refers to the problem by name, so that the mask uses the beam numbers of the bundled
problem. A design found for a part has its cross-section and material, as in files of problems, and
its size in mm::

     "section": {"shape": "rectangle", "width": 0.2, "thickness": 0.5},
     "material": {"young": 100.0, "poisson": 0.48},
     "part": {"width": 2.0, "thickness": 5.0, "scale": 10.0, "material": "ninjaflex"}
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from bellcrank.errors import InvalidFile
from bellcrank.model.builtin import builtin
from bellcrank.model.masks import unpack_mask
from bellcrank.model.parsing import Table, parse, read_json
from bellcrank.model.problem import Design, Problem, problem_to_dict
from bellcrank.model.schema import elasticity_of, section_of
from bellcrank.model.tables import ElasticityTable, SectionTable

FOLDER = Path(__file__).parent

Kind = Literal["human", "machine"]


class GalleryTable(Table):
    """File of a bundled design."""

    schema_: Literal["bellcrank/gallery/1"] = Field(alias="schema")
    problem: str
    origin: str
    mask: str
    section: SectionTable | None = None
    material: ElasticityTable | None = None
    part: dict[str, Any] | None = None


def gallery_design(kind: Kind, name: str) -> Design | None:
    """Return the bundled design of a kind for a problem.

    Parameters
    ----------
    kind
        ``"human"`` for the design drawn by hand, ``"machine"`` for the one found by a search.
    name
        Name of the problem.

    Returns
    -------
    Design or None
        None if there is none. The provenance has ``kind``, ``origin`` and, for a design for a part,
        ``part``.

    Raises
    ------
    InvalidFile
        If the bundled file does not fit its problem.

    Examples
    --------
    >>> gallery_design("machine", "scaling-20") is None
    True
    """
    path = FOLDER / kind / f"{name}.json"
    if name not in builtin or not path.is_file():
        return None
    table = parse(GalleryTable, read_json(path), path.name)
    if table.problem != name:
        raise InvalidFile(f"{path.name}: problem: expected {name!r}, got {table.problem!r}")
    problem = builtin[name]()
    if table.section is not None:
        section, material = section_of(table.section), elasticity_of(table.material)
        problem = replace(problem, section=section, material=material)
    provenance: dict[str, Any] = {"kind": kind, "origin": table.origin}
    if table.part is not None:
        provenance["part"] = table.part
    mask = unpack_mask(table.mask, problem.lattice.beam_count)
    return Design(problem=problem, mask=mask, provenance=provenance)


def human_design(name: str) -> Design | None:
    """Return the design drawn by hand for a problem, as `gallery_design`.

    Examples
    --------
    >>> human_design("scaling-8") is None
    True
    """
    return gallery_design("human", name)


def human_counterpart(problem: Problem) -> Design | None:
    """Return the human design for the same lattice, supports, input and output, if there is one.

    The name of the problem does not matter, nor do its section, its stiffness and its initial
    design.

    Examples
    --------
    >>> from dataclasses import replace
    >>> crane = builtin["crane"]()
    >>> human_counterpart(replace(crane, name="mine")) is None
    False
    """
    for path in sorted((FOLDER / "human").glob("*.json")):
        design = human_design(path.stem)
        if design is not None and _task_data(design.problem) == _task_data(problem):
            return design
    return None


def _task_data(problem: Problem) -> dict[str, Any]:
    data = problem_to_dict(problem)
    return {key: data[key] for key in ("positions", "beams", "supports", "input", "output")}
