"""Where an actuator meets others: its input and its output, as generalised coordinates.

Two views of the same design:

- `mean_ports`: one coordinate a port, the mean of the displacement along the unit directions, as in
  the efficiency; the force that does work on it is shared out equally over the nodes. An input that
  is driven by a displacement slides, as the drive moves it: along its directions and not across.
- `block_ports`: each port a rigid block of three coordinates, x, y and a finite rotation about
  the centre of its nodes; what does work on them is a force and a moment. One coordinate is not
  enough where actuators are linked: the output of most of them turns, and goes sideways.

Forces are those from outside on the actuator. All is in lattice units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Loose, Rigid, Sliding, Superelement

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics import Grip, UnloadedBeams
    from bellcrank.model import Design, Input, Output

INPUT, OUTPUT = 0, 1
"""Coordinates of `mean_ports`."""


@dataclass(frozen=True, slots=True, eq=False)
class Port:
    """A region through which an actuator is moved, or moves something.

    Parameters
    ----------
    nodes : (n,) int64
    centre : (2,)
        Mean of their positions at rest.
    direction : (2,)
        Mean of their unit directions: a unit vector if all are the same.
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


def mean_ports(
    design: Design, unloaded_beams: UnloadedBeams = "keep", *, springs: bool = False
) -> Superelement:
    """Return a design as felt through the mean motion of its ports: u_in and u_out.

    Parameters
    ----------
    design
    unloaded_beams
        As for an `SpringEvaluator`.
    springs
        Whether the problem's springs on the output belong to the actuator; by default they are
        a load like any other, and left out.

    Raises
    ------
    InvalidSettings
        If the input holds nothing that could resist, or turns about a single node.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> element = mean_ports(find_problem("crane").full_design())
    >>> len(element.measures), element.reached.all()
    (2, np.True_)
    """
    given, wanted = design.problem.input, design.problem.output
    entry: Grip
    if given.drive == "displacement":
        entry, share = Sliding(given.nodes, given.direction), np.ones(1)
    else:
        entry, share = Loose(given.nodes), _mean(given)
    exit_ = Loose(wanted.nodes)
    measures = np.zeros((2, entry.count + exit_.count))
    measures[INPUT, : entry.count] = share
    measures[OUTPUT, entry.count :] = _mean(wanted)
    return _gripped(design, [entry, exit_], measures, unloaded_beams, springs=springs)


def block_ports(
    design: Design, unloaded_beams: UnloadedBeams = "keep", *, springs: bool = False
) -> Superelement:
    """Return a design as felt through two rigid blocks: (x, y, rotation) of input, then output.

    Parameters are those of `mean_ports`.

    Raises
    ------
    InvalidSettings
        As `mean_ports`.
    """
    positions = design.problem.lattice.positions
    blocks = [Rigid(port.nodes, positions[port.nodes], port.centre) for port in ports_of(design)]
    return _gripped(design, blocks, None, unloaded_beams, springs=springs)


def _mean(region: Input | Output) -> NDArray[np.float64]:
    """(2 n,) weights of the mean displacement along the directions."""
    weights: NDArray[np.float64] = region.direction.ravel() / len(region.nodes)
    return weights


def _gripped(
    design: Design,
    grips: Sequence[Grip],
    measures: NDArray[np.float64] | None,
    unloaded_beams: UnloadedBeams,
    *,
    springs: bool,
) -> Superelement:
    element = Superelement(design, grips, measures, unloaded_beams, springs=springs)
    if not element.reached[0]:
        raise InvalidSettings(
            f"{design.problem.name}: nothing resists the input: what it holds hangs loose"
        )
    return element
