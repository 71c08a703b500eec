"""Quadratic elements by the values at their corners and edge midpoints.

NGSolve's basis is hierarchical; other codes number nodes. Between them values are handed over at
the nodes themselves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import ngsolve as ng
import numpy as np

if TYPE_CHECKING:
    from bellcrank.fem.continuum.mesh import ContinuumMesh

EDGES = {
    2: [(0, 1), (1, 2), (0, 2)],
    3: [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)],
}


def quadratic(mesh: ContinuumMesh) -> np.ndarray:
    """Return (e, 6) or (e, 10) nodes: corners, then edge midpoints, numbered after all corners."""
    corners = mesh.elements
    ends = np.sort(corners[:, EDGES[mesh.dimension]], axis=2)
    _, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    return np.hstack([corners, len(mesh.vertices) + number.reshape(len(corners), -1)])


def at_nodes(mesh: ContinuumMesh, nodes: np.ndarray, quantity: Any) -> np.ndarray:
    """Return (n, k) the values of a continuous coefficient function at the nodes."""
    corners = np.eye(mesh.dimension + 1)[:, : mesh.dimension]
    middles = corners[EDGES[mesh.dimension]].mean(axis=1)
    places = [tuple(place) for place in np.vstack([corners, middles]).tolist()]
    rule = ng.IntegrationRule(places, [1.0] * len(places))
    sampled = np.array(quantity(mesh.mesh.MapToAllElements(rule, ng.VOL)))
    values = np.zeros((nodes.max() + 1, sampled.shape[1]))
    values[nodes.ravel()] = sampled
    return values


def positions_of(mesh: ContinuumMesh, nodes: np.ndarray) -> np.ndarray:
    """Return (n, d) the nodes at rest, mm."""
    return at_nodes(mesh, nodes, ng.CF((ng.x, ng.y, ng.z)[: mesh.dimension]))
