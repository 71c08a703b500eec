"""Motion of input and output nodes from the corners of the markers glued to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.output import motion_weights, rotation_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.measure.layout import Marker
    from bellcrank.model import Problem
    from bellcrank.part import Part

    Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Motion of input and output in F states.

    Parameters
    ----------
    input : (F,) float64, mm
        Mean over the input nodes of the displacement along the direction of each.
    along : (F,) float64, mm
        Mean over the output nodes of the displacement along the wanted direction of each.
    across : (F, 2) float64, mm
        Mean of the displacements of the output nodes normal to these directions.
    rotation : (F,) float64, degrees
        Best-fit rotation of the output, counter-clockwise.
    path : (F, 2) float64, mm
        Mean displacement of the output nodes.
    """

    input: Values
    along: Values
    across: Values
    rotation: Values
    path: Values

    @property
    def columns(self) -> Values:
        """Columns (F, 7): input, along, across (2), rotation, path (2)."""
        return np.column_stack([self.input, self.along, self.across, self.rotation, self.path])


def motion_of_nodes(
    problem: Problem, input_moved: Values, output_moved: Values, scale: float
) -> Motion:
    """Return the motion for displacements of the input and the output nodes.

    Parameters
    ----------
    problem
        Planar problem.
    input_moved, output_moved : (F, n, 2), mm
        Displacements of its input and output nodes.
    scale
        Length of a lattice unit, mm.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> down, left = np.zeros((1, 10, 2)), np.zeros((1, 9, 2))
    >>> down[..., 1], left[..., 0], left[..., 1] = -2.0, -6.0, 1.5
    >>> motion = motion_of_nodes(crane, down, left, 10.0)
    >>> motion.input.tolist(), motion.along.tolist(), motion.across[0].tolist()
    ([2.0], [6.0], [0.0, 1.5])
    """
    pushed = np.einsum("na,fna->f", problem.input.direction, input_moved) / input_moved.shape[1]
    means = np.einsum("kna,fna->fk", motion_weights(problem), output_moved)
    before = scale * problem.lattice.positions[problem.output.nodes]
    before = before - before.mean(axis=0)
    if len(before) > 1:
        after = before + output_moved
        turned = np.einsum("fni,nj->fij", after - after.mean(axis=1, keepdims=True), before)
        rotation = np.degrees(np.unwrap(np.radians(rotation_of(turned))))
    else:
        rotation = np.full(len(pushed), np.nan)
    return Motion(pushed, means[:, 0], means[:, 1:], rotation, output_moved.mean(axis=1))


def rigid_motion(corners: Values, rest: Values) -> tuple[Values, Values]:
    """Return displacement and rotation of squares from their corners.

    Parameters
    ----------
    corners : (F, 4, 2), mm
        Corners in each state.
    rest : (4, 2), mm
        Corners at rest.

    Returns
    -------
    (F, 2) float64, mm
        Displacement of the centre.
    (F,) float64, radians
        Rotation, counter-clockwise, continuous from state to state.

    Examples
    --------
    >>> square = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
    >>> moved, turned = rigid_motion((square[:, ::-1] * [-1.0, 1.0] + [3.0, 0.0])[None], square)
    >>> moved.tolist(), np.degrees(turned).tolist()
    ([[3.0, 0.0]], [90.0])
    """
    before = rest - rest.mean(axis=0)
    middle = corners.mean(axis=1)
    after = corners - middle[:, None]
    sine = (before[:, 0] * after[..., 1] - before[:, 1] * after[..., 0]).sum(axis=1)
    cosine = (before * after).sum(axis=(1, 2))
    return middle - rest.mean(axis=0), np.unwrap(np.arctan2(sine, cosine))


def node_motion(
    markers: Sequence[Marker],
    corners: Values,
    rest: Values,
    nodes: NDArray[np.int64],
    positions: Values,
    offsets: Values,
) -> Values:
    """Return the displacement of nodes that move with markers as rigid bodies.

    Parameters
    ----------
    markers
        K markers; each node belongs to one of them, or moves with the mean of the others.
    corners, rest : (F, K, 4, 2) and (K, 4, 2), mm
        Corners in each state and at rest.
    nodes : (n,) int64
        Numbers of the nodes.
    positions : (N, 2), mm
        All nodes at rest.
    offsets : (K, 2), mm
        Position of each marker on the part less that in the drawing.

    Returns
    -------
    (F, n, 2) float64, mm
    """
    moved = np.full((len(corners), len(nodes), 2), np.nan)
    for k, marker in enumerate(markers):
        own = np.isin(nodes, marker.nodes)
        shift, angle = rigid_motion(corners[:, k], rest[k])
        arm = positions[nodes[own]] - marker.centre - offsets[k]
        cosine, sine = np.cos(angle)[:, None] - 1.0, np.sin(angle)[:, None]
        turned = np.stack(
            [cosine * arm[:, 0] - sine * arm[:, 1], sine * arm[:, 0] + cosine * arm[:, 1]], axis=-1
        )
        moved[:, own] = shift[:, None] + turned
    # Nodes without struts have no marker.
    bare = np.isnan(moved[0, :, 0]) if len(moved) else np.zeros(len(nodes), dtype=np.bool_)
    moved[:, bare] = moved[:, ~bare].mean(axis=1, keepdims=True)
    return moved


def part_motion(
    part: Part, markers: Sequence[Marker], corners: Values, rest: slice, offsets: Values
) -> Motion:
    """Return the motion of input and output of a part.

    Parameters
    ----------
    part
        The part.
    markers
        K markers on input and output.
    corners : (F, K, 4, 2), mm
        Their corners.
    rest
        Frames at rest.
    offsets : (K, 2), mm
        Position of each marker on the part less that in the drawing.
    """
    problem, zero = part.design.problem, corners[rest].mean(axis=0)
    moved = []
    for role, nodes in (("input", problem.input.nodes), ("output", problem.output.nodes)):
        own = [k for k, marker in enumerate(markers) if marker.role == role]
        moved.append(
            node_motion(
                [markers[k] for k in own], corners[:, own], zero[own], nodes, part.positions,
                offsets[own],
            )
        )  # fmt: skip
    return motion_of_nodes(problem, moved[0], moved[1], part.scale)
