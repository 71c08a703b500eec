"""Lattices, problems and designs.

A `Problem` is a `Lattice` with supports, input and output; a frame problem also has the
cross-section and the material of its beams. A `Design` is a problem with a mask of the beams that
are present. All objects are immutable and validated on construction.

Examples
--------
>>> from bellcrank.model import find_problem
>>> problem = find_problem("crane")
>>> design = problem.full_design()
>>> design.beam_count, len(problem.designable)
(352, 203)

Removing a beam makes a new design:

>>> mask = design.mask.copy()
>>> mask[problem.designable[0]] = False
>>> design.with_mask(mask).beam_count
351

Problems are written in TOML (see `bellcrank.model.schema`) and read by `read_problem`; designs
are stored in JSON.
"""

from bellcrank.model.builtin import IN_SPACE, builtin
from bellcrank.model.conditions import Input, Output, Stiffness, Supports
from bellcrank.model.files import (
    design_from_dict,
    design_to_dict,
    find_problem,
    read_design,
    read_masks,
    read_problem,
    write_design,
    write_problem,
)
from bellcrank.model.gallery import gallery_design, human_counterpart, human_design
from bellcrank.model.lattice import Lattice
from bellcrank.model.lattices import lattices
from bellcrank.model.loads import Loads, NodeForce, NodeSpring
from bellcrank.model.masks import pack_mask, unpack_mask
from bellcrank.model.plane import require_plane
from bellcrank.model.problem import Design, Problem, problem_to_dict
from bellcrank.model.regions import regions
from bellcrank.model.schema import problem_from_dict
from bellcrank.model.section import Elasticity, Section
from bellcrank.model.specification import (
    CARRIED,
    QUANTITIES,
    Case,
    Item,
    ObjectiveTerm,
    QuantityType,
    Specification,
)
from bellcrank.model.tolerances import Tolerances

__all__ = [
    "CARRIED",
    "IN_SPACE",
    "QUANTITIES",
    "Case",
    "Design",
    "Elasticity",
    "Input",
    "Item",
    "Lattice",
    "Loads",
    "NodeForce",
    "NodeSpring",
    "ObjectiveTerm",
    "Output",
    "Problem",
    "QuantityType",
    "Section",
    "Specification",
    "Stiffness",
    "Supports",
    "Tolerances",
    "builtin",
    "design_from_dict",
    "design_to_dict",
    "find_problem",
    "gallery_design",
    "human_counterpart",
    "human_design",
    "lattices",
    "pack_mask",
    "problem_from_dict",
    "problem_to_dict",
    "read_design",
    "read_masks",
    "read_problem",
    "regions",
    "require_plane",
    "unpack_mask",
    "write_design",
    "write_problem",
]
