"""Ports of an actuator: its input and its output as generalised coordinates.

Each port has one coordinate, the mean of the displacement of its nodes along their unit
directions, as in the efficiency. The conjugate force is distributed equally over the nodes. The
nodes of an input that is driven by a displacement move along their directions only. The nodes of
frames rotate freely.

Forces are external forces on the actuator. Quantities are in lattice units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Superelement, free_nodes, uniform_motion

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import UnloadedBeams
    from bellcrank.model import Design, Input, Output, Problem

INPUT, OUTPUT = 0, 1
"""Coordinates of `mean_ports`."""


@dataclass(frozen=True, slots=True, eq=False)
class Port:
    """Region of an actuator that is driven, or that drives something else.

    Parameters
    ----------
    nodes : (n,) int64
    centre : (d,)
        Mean position of the nodes at rest.
    direction : (d,)
        Mean of the unit directions of the nodes.
    """

    nodes: NDArray[np.int64]
    centre: NDArray[np.float64]
    direction: NDArray[np.float64]


def ports_of(design: Design) -> tuple[Port, Port]:
    """Return the input and the output of a design.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> given, wanted = ports_of(find_problem("crane").full_design())
    >>> given.centre.round(2), wanted.direction
    (array([9.  , 8.66]), array([-1.,  0.]))
    """
    positions, problem = design.problem.lattice.positions, design.problem
    given, wanted = (
        Port(region.nodes, positions[region.nodes].mean(axis=0), region.direction.mean(axis=0))
        for region in (problem.input, problem.output)
    )
    return given, wanted


def check_one_motion(problem: Problem) -> None:
    """Check that inputs and loads grow together.

    Raises
    ------
    InvalidSettings
        If they grow in parts of the stroke (`Problem.has_ranges`).
    """
    if problem.has_ranges:
        raise InvalidSettings(
            f"problem {problem.name!r}: expected inputs and loads that grow together, got "
            "'during'; a port has one coordinate"
        )


def mean_ports(design: Design, unloaded_beams: UnloadedBeams = "keep") -> Superelement:
    """Return the superelement of a design with the coordinates u_in and u_out.

    The springs of the problem at its output are a load, and left out.

    Parameters
    ----------
    design
        Actuator.
    unloaded_beams
        As for `bellcrank.mechanics.SpringEvaluator`.

    Raises
    ------
    InvalidSettings
        If the input meets no resistance, rotates about a single node, or its nodes do not move
        together.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> element = mean_ports(find_problem("crane").full_design())
    >>> len(element.measures), element.reached.all()
    (2, np.True_)
    """
    check_one_motion(design.problem)
    given, wanted = design.problem.input, design.problem.output
    dimension = design.problem.lattice.dimension
    if given.drive == "displacement":
        entry, weights = uniform_motion(given.nodes, given.direction), np.ones(1)
    else:
        entry, weights = free_nodes(given.nodes, dimension), _mean_weights(given)
    exit_ = free_nodes(wanted.nodes, dimension)
    measures = np.zeros((2, entry.count + exit_.count))
    measures[INPUT, : entry.count] = weights
    measures[OUTPUT, entry.count :] = _mean_weights(wanted)
    element = Superelement(design, [entry, exit_], measures, unloaded_beams)
    if not element.reached[0]:
        raise InvalidSettings(
            f"{design.problem.name}: nothing resists the input: it is not connected to a support"
        )
    return element


def _mean_weights(region: Input | Output) -> NDArray[np.float64]:
    """(d n,) weights of the mean displacement along the directions."""
    weights: NDArray[np.float64] = region.direction.ravel() / len(region.nodes)
    return weights
