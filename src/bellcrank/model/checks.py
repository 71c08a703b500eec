"""Checks of the parts of a problem against each other; they raise `InvalidProblem`."""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import check_ids, locked, real_array
from bellcrank.model.conditions import ROLLERS, Aggregate
from bellcrank.model.section import Elasticity, Section
from bellcrank.model.stroke_ranges import check_cover

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.model.conditions import Input, Output, Supports
    from bellcrank.model.lattice import Lattice
    from bellcrank.model.loads import Loads


def check_texts(name: object, aggregate: object, objective: object) -> None:
    """Check name, aggregate and objective."""
    if not isinstance(name, str) or not name.strip():
        raise InvalidProblem(f"name: expected some text, got {name!r}")
    if aggregate not in get_args(Aggregate):
        raise InvalidProblem(f"aggregate: expected 'mean' or 'sum', got {aggregate!r}")
    if objective is not None and (not isinstance(objective, str) or not objective.strip()):
        raise InvalidProblem(f"objective: expected a name, got {objective!r}")


def check_section(lattice: Lattice, section: object, material: object) -> None:
    """Check that section and material belong together, and that the section fits the space."""
    if section is None:
        if material is not None:
            raise InvalidProblem("material: given without section; expected both, or the section")
        if lattice.dimension == 3:
            raise InvalidProblem(
                "positions: positions in space need a section, because the spring model is "
                f"planar; got shape {lattice.positions.shape}; give a round section"
            )
        return
    if not isinstance(section, Section):
        raise InvalidProblem(f"section: expected a Section, got {section!r}")
    if material is not None and not isinstance(material, Elasticity):
        raise InvalidProblem(f"material: expected an Elasticity, got {material!r}")
    if lattice.dimension == 3 and section.shape != "round":
        raise InvalidProblem(
            f"section.shape: expected 'round' for positions in space, got {section.shape!r}, "
            "whose orientation is unknown"
        )


def check_frame_only(
    section: Section | None, inputs: Input, loads: Loads, specification: object
) -> None:
    """Check what only frames have: loads, a specification, parts of the stroke (`Input.during`).

    They need a section, and an input or a load that grows at every fraction of the stroke.
    """
    if section is not None:
        check_cover("input.during", np.concatenate([inputs.ranges, loads.ranges]))
    elif inputs.during is not None:
        raise InvalidProblem(
            "input.during: expected a problem with a section; in the spring model all inputs move "
            "along the whole stroke"
        )
    elif loads or specification is not None:
        raise InvalidProblem(
            "loads and specification: expected a problem with a section; the spring model has "
            "neither"
        )


def check_widths(
    lattice: Lattice, section: Section | None, widths: ArrayLike | None
) -> NDArray[np.float64] | None:
    """Return the widths of beams (M,), if any are given."""
    if widths is None:
        return None
    if section is None:
        raise InvalidProblem("widths: expected a problem with a section; springs have no width")
    given = real_array("widths", widths)
    if given.shape != (lattice.beam_count,):
        raise InvalidProblem(
            f"widths: expected shape ({lattice.beam_count},), one for each beam, got {given.shape}"
        )
    if not (given > 0.0).all():
        wrong = int(np.argmin(given))
        raise InvalidProblem(f"widths[{wrong}]: expected a number above 0, got {given[wrong]:g}")
    return locked(given)


def check_joints(lattice: Lattice, joints: ArrayLike | None) -> NDArray[np.float64] | None:
    """Return the lengths (M, 2) of the joints of beams, if any are given."""
    if joints is None:
        return None
    given = real_array("joints", joints)
    if given.shape != (lattice.beam_count, 2):
        raise InvalidProblem(
            f"joints: expected shape ({lattice.beam_count}, 2), both ends of each beam, "
            f"got {given.shape}"
        )
    wrong = (given < 0.0).any(axis=1) | (given.sum(axis=1) >= lattice.rest_length)
    if wrong.any():
        beam = int(np.argmax(wrong))
        raise InvalidProblem(
            f"joints[{beam}]: expected lengths from 0, together less than that of the beam, "
            f"{lattice.rest_length[beam]:g}, got {given[beam].tolist()}"
        )
    return locked(given)


def check_slender(
    lattice: Lattice, section: Section, widths: NDArray[np.float64], possible: NDArray[np.bool_]
) -> None:
    """Check that no beam that may be present, `possible` (M,), is shorter than wide."""
    lengths = np.where(possible, lattice.rest_length, np.inf)
    worst = int((lengths / widths).argmin())
    name = "diameter" if section.shape == "round" else "width"
    if widths[worst] >= lengths[worst]:
        raise InvalidProblem(
            f"section.{name}: beams {widths[worst]:g} wide are not slender where "
            f"beams[{worst}] is {lengths[worst]:g} long; expected a smaller {name}"
        )


def check_coordinates(
    lattice: Lattice, supports: Supports, inputs: Input, outputs: list[Output], loads: Loads
) -> None:
    """Check that directions, loads and supports have the coordinates of the positions."""
    dimension = lattice.dimension
    vectors = [("input.direction", inputs.direction)]
    vectors += [("output.direction", output.direction) for output in outputs]
    for name, given in (*vectors, *loads.vectors()):
        if given.shape[1] != dimension:
            raise InvalidProblem(
                f"{name}: expected vectors of {dimension} coordinates like the "
                f"positions, got {given[0].tolist()}"
            )
    if dimension == 2 and len(supports.fixed_z):
        raise InvalidProblem(
            f"supports.fixed_z: expected no nodes in the plane, got {supports.fixed_z[0]}"
        )


def check_regions(
    lattice: Lattice,
    supports: Supports,
    inputs: Input,
    outputs: list[Output],
    loads: Loads,
    *,
    sliding: bool,
) -> None:
    """Check that supports, input, outputs and loads name existing nodes and do not overlap.

    Forces and springs may act on any node. In space a node may be fixed in two coordinates. With
    `sliding`, an output, or an input that is driven by a force, may be on rollers.
    """
    names = [f"supports.{name}" for name in ("fixed", *ROLLERS)]
    regions = dict(zip(names, [supports.fixed, *supports.rollers(3)], strict=True))
    regions |= {"input.nodes": inputs.nodes}
    regions |= {f"output{k or ''}.nodes": output.nodes for k, output in enumerate(outputs)}
    for name, nodes in (*regions.items(), ("loads", loads.nodes)):
        check_ids(name, nodes, lattice.node_count, "node")
    held = names[:1] if sliding and inputs.drive == "force" else names
    pairs = [("input.nodes", name) for name in held]
    pairs += [
        (f"output{k or ''}.nodes", name)
        for k in range(len(outputs))
        for name in (*(names[:1] if sliding else names), "input.nodes")
    ]
    for name, other in pairs:
        if len(common := np.intersect1d(regions[name], regions[other])):
            raise InvalidProblem(
                f"{name}: node {common[0]} is also in {other}; regions must not overlap"
            )


def check_connection(lattice: Lattice, inputs: Input, outputs: Output) -> None:
    """Check that a path of beams connects input and output."""
    # One connected node is sufficient: regions of a jammed packing may contain discs without
    # contacts.
    reached = lattice.reachable(inputs.nodes)
    if not reached[outputs.nodes].any():
        raise InvalidProblem(
            f"output.nodes: node {outputs.nodes[0]} and all other output nodes are not "
            "connected to the input by beams, even in the full lattice"
        )
