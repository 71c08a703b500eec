"""The same bodies in CalculiX: an independent answer.

Its elastic material is Hooke's law, and with NLGEOM that of St Venant and Kirchhoff.
"""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING

import numpy as np

from tests.fem.nodes import positions_of, quadratic

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from bellcrank.fem.continuum.mesh import ContinuumMesh
    from bellcrank.part.part import Part

# Integrals of the functions of corners and of edge midpoints over a tetrahedron, by its volume.
CORNER, MIDDLE = -1.0 / 20.0, 1.0 / 5.0


def respond(
    part: Part, mesh: ContinuumMesh, folder: Path, *, nonlinear: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 3) the displacements of quadratic nodes and (h, 3) the forces on clamped hubs."""
    nodes = quadratic(mesh)
    (folder / "part.inp").write_text("\n".join(deck(part, mesh, nodes, nonlinear=nonlinear)))
    done = subprocess.run(
        ["ccx", "part"], cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )
    if "Job finished" not in done.stdout:
        raise RuntimeError(done.stdout[-2000:])
    tables = read(folder / "part.dat")
    count = int(nodes.max()) + 1
    hubs = [nodes[mesh.hub_of_element == node] for node in part.design.problem.supports.fixed]
    forces = [tables["forces"][np.unique(hub)].sum(axis=0) for hub in hubs]
    return tables["displacements"][:count], np.array(forces)


def deck(part: Part, mesh: ContinuumMesh, nodes: np.ndarray, *, nonlinear: bool) -> Iterator[str]:
    """Yield the lines of an input file; each driven hub has a node that moves as its mean."""
    problem = part.design.problem
    given = problem.input
    count = int(nodes.max()) + 1
    places = np.vstack([positions_of(mesh, nodes), np.zeros((len(given.nodes), 3))])
    yield "*NODE, NSET=ALL"
    yield from (f"{k}, {x:.12e}, {y:.12e}, {z:.12e}" for k, (x, y, z) in enumerate(places, 1))
    yield "*ELEMENT, TYPE=C3D10, ELSET=PART"
    yield from (
        f"{k}, " + ", ".join(map(str, corners)) for k, corners in enumerate(nodes + 1, start=1)
    )
    yield "*MATERIAL, NAME=RUBBER"
    yield "*ELASTIC"
    yield f"{part.material.young:.15g}, {part.material.poisson:.15g}"
    yield "*SOLID SECTION, ELSET=PART, MATERIAL=RUBBER"
    for grip, node in enumerate(given.nodes.tolist(), start=count + 1):
        shares = shares_of(places, nodes[mesh.hub_of_element == node])
        for axis in (1, 2, 3):
            yield "*EQUATION"
            yield f"{len(shares) + 1}"
            # What comes first is eliminated, and must not be a corner without a share.
            order = sorted(shares, key=lambda one: -abs(shares[one]))
            yield from (f"{one + 1}, {axis}, {shares[one]:.12e}" for one in order)
            yield f"{grip}, {axis}, -1.0"
    yield "*BOUNDARY"
    held = np.unique(nodes[np.isin(mesh.hub_of_element, problem.supports.fixed)])
    yield from (f"{node + 1}, 1, 3" for node in held)
    yield "*STEP, NLGEOM" if nonlinear else "*STEP"
    yield "*STATIC, DIRECT" if nonlinear else "*STATIC"
    yield "0.25, 1.0" if nonlinear else "1.0, 1.0"
    if nonlinear:
        yield "*CONTROLS, PARAMETERS=FIELD"
        yield "1e-9, 1e-7, , , , , 1e-9"
    yield "*BOUNDARY"
    motion = given.amount * part.scale * given.direction
    for grip, (x, y) in enumerate(motion.tolist(), start=count + 1):
        for axis, value in enumerate((x, y, 0.0), start=1):
            yield f"{grip}, {axis}, {axis}, {value:.12e}"
    yield "*NODE PRINT, NSET=ALL, FREQUENCY=1000"
    yield "U"
    yield "*NODE PRINT, NSET=ALL, FREQUENCY=1000"
    yield "RF"
    yield "*END STEP\n"


def shares_of(places: np.ndarray, hub: np.ndarray) -> dict[int, float]:
    """Return what each node's displacement counts in the mean over some tetrahedra (e, 10)."""
    edges = places[hub[:, 1:4]] - places[hub[:, :1]]
    volume = np.abs(np.linalg.det(edges)) / 6.0
    weights = volume[:, None] / volume.sum() * ([CORNER] * 4 + [MIDDLE] * 6)
    shares = np.bincount(hub.ravel(), weights=weights.ravel())
    return {node: float(shares[node]) for node in np.unique(hub).tolist()}


def read(path: Path) -> dict[str, np.ndarray]:
    """Return the last of each table in a file of results by its first word."""
    tables: dict[str, list[list[float]]] = {}
    rows: list[list[float]] = []
    for line in path.read_text().splitlines():
        words = line.split()
        if not words:
            continue
        if words[0].isalpha():
            rows = tables[words[0]] = []
        else:
            rows.append([float(word) for word in words[1:]])
    return {name: np.array(table) for name, table in tables.items()}
