"""Problem files: schema ``bellcrank/problem/1``, in TOML or JSON.

The lattice is generated from parameters or listed in full, and nodes are given by regions or by
number. Both forms can be combined.

::

    schema = "bellcrank/problem/1"
    name = "my-gripper"
    aggregate = "mean"              # or "sum"; optional
    objective = "displacement"      # optional, by default chosen by the drive

    [lattice]                       # or: positions = [[x, y], ...], beams = [[a, b], ...];
                                    # in space [[x, y, z], ...]
    kind = "triangular-rows"        # a name in `bellcrank.model.lattices`
    counts = [5, 6, 5, 6]           # its parameters; `seed` for the disordered ones
    first_x = [0.5, 0.0, 0.5, 0.0]

    [supports]                      # lists of regions and node numbers
    fixed = [{ row = 0 }]           # also fixed_x, fixed_y: rollers; in space also fixed_z

    [input]
    nodes = [{ row = -1, rightmost = 2 }]
    direction = [0, -1]             # one unit vector, or one for each node; in space [0, 0, -1]
    drive = "displacement"          # or "force"
    amount = 0.1                    # lattice units, at most the size of the lattice
    during = [[0, 0.5], [0.5, 1]]   # fractions of the stroke between which it grows, one pair or
                                    # one for each node; optional, with a section

    [output]
    nodes = [{ row = -1, leftmost = 2 }]
    direction = [-1, 0]
    spring = 0.5                    # optional
    spring_kind = "directional"     # or "isotropic"; optional

    [stiffness]                     # of the spring model; optional, with optional keys
    bond = 5.0
    angle = 0.1

    [section]                       # makes the beams those of a frame; optional
    shape = "rectangle"             # or: shape = "round", diameter = 0.2
    width = 0.2                     # in the plane of the lattice, lattice units
    thickness = 0.5                 # normal to it, lattice units
    joint = 0.05                    # ends of beams that do not bend; optional, 0 by default

    [material]                      # of a frame; optional, these are the defaults
    young = 1.0
    poisson = 0.48

Positions in space need a round section. Without a section a problem is one of the spring model.
Regions are described in `bellcrank.model.regions`. Further keys are optional: `initial`, the mask
of the beams present in the initial design; `designable`, the numbers of the beams that a search
may change; or, in place of `designable`, `frozen`, a list of regions whose beams it may not change
in addition to those at supports, input and output.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import BellcrankError, InvalidFile, InvalidProblem
from bellcrank.model.arrays import check_ids
from bellcrank.model.calls import call_with_keys
from bellcrank.model.conditions import Input, Output, Stiffness, Supports
from bellcrank.model.lattice import Lattice
from bellcrank.model.lattices import lattices
from bellcrank.model.loads import Loads, NodeForce, NodeSpring
from bellcrank.model.masks import unpack_mask
from bellcrank.model.parsing import parse
from bellcrank.model.problem import Problem
from bellcrank.model.regions import regions
from bellcrank.model.section import Elasticity, Section, Shape
from bellcrank.model.specification import Case, Item, ObjectiveTerm, Specification
from bellcrank.model.tables import ProblemTable
from bellcrank.model.tolerances import Tolerances

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bellcrank.model.tables import (
        ElasticityTable,
        InputTable,
        LoadsTable,
        OutputTable,
        SectionTable,
        SpecificationTable,
        SupportsTable,
    )


LATTICE_UNIT = 10.0
"""Default length of a lattice unit in a part, mm."""


def problem_from_dict(data: Mapping[str, Any], source: str = "problem") -> Problem:
    """Return the problem that plain data describes.

    Parameters
    ----------
    data
        Content of a file, as read from TOML or JSON.
    source
        Name of the data in errors, usually the file.

    Raises
    ------
    InvalidFile
        If a key is unknown or missing, or a value has the wrong type.
    InvalidProblem
        If the problem is not valid, or its displacement exceeds the size of the lattice.

    Examples
    --------
    >>> problem = problem_from_dict({
    ...     "schema": "bellcrank/problem/1",
    ...     "name": "small",
    ...     "lattice": {"kind": "triangular-rectangle", "columns": 5, "rows": 6},
    ...     "supports": {"fixed": [{"row": 0}]},
    ...     "input": {
    ...         "nodes": [{"row": -1, "rightmost": 2}],
    ...         "direction": [0, -1],
    ...         "drive": "displacement",
    ...         "amount": 0.1,
    ...     },
    ...     "output": {"nodes": [{"row": -1, "leftmost": 2}], "direction": [-1, 0]},
    ... })
    >>> problem.lattice.node_count, problem.input.nodes
    (33, array([31, 32]))
    """
    table = parse(ProblemTable, data, source)
    try:
        return _build(table)
    except (InvalidFile, InvalidProblem) as error:
        raise type(error)(f"{source}: {error}") from None
    except BellcrankError as error:  # an unknown lattice or region
        raise InvalidFile(f"{source}: {error}") from None


def _build(table: ProblemTable) -> Problem:
    lattice = _lattice(table)
    if table.input.drive == "displacement":
        _check_amount(lattice, table.input.amount)
    problem = Problem(
        name=table.name,
        lattice=lattice,
        supports=_supports(lattice, table.supports),
        input=_input(lattice, table.input),
        output=_output(lattice, table.output, "output"),
        stiffness=Stiffness(bond=table.stiffness.bond, angle=table.stiffness.angle),
        initial=_initial(table, lattice),  # type: ignore[arg-type]  # None means all
        designable=table.designable,  # type: ignore[arg-type]  # checked there
        aggregate=table.aggregate,
        objective=table.objective,
        section=section_of(table.section),
        material=elasticity_of(table.material),
        loads=_loads(lattice, table.loads, "loads"),
        specification=_specification(lattice, table.specification),
        widths=table.widths,  # type: ignore[arg-type]  # checked there
        joints=table.joints,  # type: ignore[arg-type]  # checked there
    )
    return _freeze(problem, table)


def _supports(lattice: Lattice, table: SupportsTable) -> Supports:
    return Supports(
        fixed=_nodes(lattice, table.fixed, "supports.fixed"),
        fixed_x=_nodes(lattice, table.fixed_x, "supports.fixed_x"),
        fixed_y=_nodes(lattice, table.fixed_y, "supports.fixed_y"),
        fixed_z=_nodes(lattice, table.fixed_z, "supports.fixed_z"),
    )


def _input(lattice: Lattice, table: InputTable) -> Input:
    return Input(
        nodes=_nodes(lattice, table.nodes, "input.nodes"),
        direction=table.direction,  # type: ignore[arg-type]  # checked there
        drive=table.drive,
        amount=table.amount,
        during=table.during,  # type: ignore[arg-type]  # checked there
    )


def _output(lattice: Lattice, table: OutputTable, key: str) -> Output:
    return Output(
        nodes=_nodes(lattice, table.nodes, f"{key}.nodes"),
        direction=table.direction,  # type: ignore[arg-type]  # checked there
        spring=table.spring,
        spring_kind=table.spring_kind,
    )


def _loads(lattice: Lattice, table: LoadsTable, key: str) -> Loads:
    forces = [
        NodeForce(
            _nodes(lattice, each.nodes, f"{key}.forces[{k}].nodes"),
            each.force,  # type: ignore[arg-type]  # checked there
            each.during,  # type: ignore[arg-type]
        )
        for k, each in enumerate(table.forces)
    ]
    springs = [
        NodeSpring(
            _nodes(lattice, each.nodes, f"{key}.springs[{k}].nodes"),
            each.direction,  # type: ignore[arg-type]  # checked there
            each.stiffness,
        )
        for k, each in enumerate(table.springs)
    ]
    return Loads(tuple(forces), tuple(springs), table.weight, table.weight_during)  # type: ignore[arg-type]


def _specification(lattice: Lattice, table: SpecificationTable | None) -> Specification | None:
    if table is None:
        return None
    key = "specification"
    cases = [
        Case(
            name=each.name,
            supports=_supports(lattice, each.supports),
            input=_input(lattice, each.input),
            outputs={
                name: _output(lattice, output, f"{key}.cases[{k}].outputs.{name}")
                for name, output in each.outputs.items()
            },
            loads=_loads(lattice, each.loads, f"{key}.cases[{k}].loads"),
        )
        for k, each in enumerate(table.cases)
    ]
    deviations = table.tolerances
    tolerances = None if deviations is None else Tolerances(**deviations.model_dump())
    return Specification(
        case=table.case,
        output=table.output,
        outputs={
            name: _output(lattice, output, f"{key}.outputs.{name}")
            for name, output in table.outputs.items()
        },
        cases=tuple(cases),
        items=tuple(Item(**each.model_dump()) for each in table.items),
        maximise=tuple(ObjectiveTerm(**each.model_dump()) for each in table.maximise),
        weight=table.weight,  # type: ignore[arg-type]  # cast there
        symmetry=tuple(table.symmetry),
        domain=tuple(table.domain),  # type: ignore[arg-type]  # cast there
        tolerances=tolerances,
    )


def _lattice(table: ProblemTable) -> Lattice:
    if table.lattice is None:
        if table.positions is None or table.beams is None:
            missing = "positions" if table.positions is None else "beams"
            raise InvalidFile(
                f"key '{missing}' is missing (expected positions and beams, or a lattice)"
            )
        return Lattice(
            positions=table.positions,  # type: ignore[arg-type]  # cast there
            beams=table.beams,  # type: ignore[arg-type]
        )
    if table.positions is not None or table.beams is not None:
        raise InvalidFile("expected positions and beams or a lattice, got both")
    parameters = dict(table.lattice)
    if "kind" not in parameters:
        raise InvalidFile("key 'lattice.kind' is missing")
    kind = parameters.pop("kind")
    if not isinstance(kind, str):
        raise InvalidFile(f"lattice.kind: expected a name, got {kind!r}")
    lattice: Lattice = call_with_keys(lattices[kind], parameters, "lattice")
    return lattice


def _check_amount(lattice: Lattice, amount: float) -> None:
    """Check that an input displacement is not larger than the lattice.

    Raises
    ------
    InvalidProblem
        If it is, as where millimetres were given instead of lattice units.
    """
    extent = float(np.ptp(lattice.positions, axis=0).max())
    if amount > extent:
        length = float(np.median(lattice.rest_length))
        raise InvalidProblem(
            f"input.amount: {amount:g} lattice units are {amount / length:.3g} beam lengths, more "
            f"than the size of the lattice ({extent:.4g}); expected a displacement in lattice "
            f"units (a part has {LATTICE_UNIT:g} mm for each by default)"
        )


def _nodes(lattice: Lattice, entries: list[Any], key: str) -> NDArray[np.int64]:
    """Return the nodes of numbers and regions, in the order given, without repetitions."""
    found: dict[int, None] = {}
    for index, entry in enumerate(entries):
        where = f"{key}[{index}]"
        if isinstance(entry, int) and not isinstance(entry, bool):
            if entry in found:
                raise InvalidProblem(f"{where}: node {entry} is listed twice")
            found[entry] = None
        elif isinstance(entry, dict):
            found.update(dict.fromkeys(_region(lattice, entry, where)))
        else:
            raise InvalidFile(f"{where}: expected a node number or a region, got {entry!r}")
    return np.array(list(found), dtype=np.int64)


def _region(lattice: Lattice, entry: dict[str, Any], where: str) -> list[int]:
    kinds = [name for name in entry if name in regions]
    if len(kinds) != 1:
        raise InvalidFile(
            f"{where}: expected one of the keys {', '.join(regions)}, "
            f"got {', '.join(entry) or 'none'}"
        )
    try:
        nodes: list[int] = call_with_keys(regions[kinds[0]], entry, where, lattice).tolist()
    except InvalidProblem as error:
        raise InvalidProblem(f"{where}.{error}") from None
    if not nodes:
        raise InvalidProblem(f"{where}: no node lies in this region")
    return nodes


SECTION_KEYS: dict[Shape, tuple[str, ...]] = {
    "rectangle": ("width", "thickness"),
    "round": ("diameter",),
}
"""Lengths of each shape."""


def elasticity_of(table: ElasticityTable | None) -> Elasticity | None:
    """Return the elastic constants that ``[material]`` describes."""
    return None if table is None else Elasticity(**table.model_dump())


def section_of(table: SectionTable | None) -> Section | None:
    """Return the cross-section that ``[section]`` describes.

    Raises
    ------
    InvalidFile
        If a length is missing, or is not one of its shape.
    """
    if table is None:
        return None
    known = SECTION_KEYS[table.shape]
    lengths = table.model_dump(exclude={"shape", "joint"}, exclude_none=True)
    for key in known:
        if key not in lengths:
            raise InvalidFile(
                f"key 'section.{key}' is missing (section.shape is {table.shape!r}, whose keys "
                f"are {', '.join(known)})"
            )
    for key in lengths:
        if key not in known:
            raise InvalidFile(
                f"unknown key 'section.{key}' (section.shape is {table.shape!r}, whose keys are "
                f"{', '.join(known)})"
            )
    make = Section if table.shape == "rectangle" else Section.round
    return make(**lengths, joint=table.joint)


def _initial(table: ProblemTable, lattice: Lattice) -> NDArray[np.bool_] | None:
    if table.initial is None:
        return None
    try:
        return unpack_mask(table.initial, lattice.beam_count)
    except InvalidFile as error:
        raise InvalidFile(f"initial: {str(error).removeprefix('mask: ')}") from None


def _freeze(problem: Problem, table: ProblemTable) -> Problem:
    if not table.frozen:
        return problem
    if table.designable is not None:
        raise InvalidFile("expected designable or frozen, got both")
    nodes = _nodes(problem.lattice, table.frozen, "frozen")
    check_ids("frozen", nodes, problem.lattice.node_count, "node")
    touched = problem.lattice.beams_touching(nodes)
    return replace(problem, designable=problem.designable[~touched[problem.designable]])
