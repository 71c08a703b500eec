"""VTU: the lattice with data of its nodes and beams, for ParaView."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bellcrank.model import Problem

    Values = NDArray[Any]

KINDS = {2: "line", 3: "triangle", 4: "tetra"}
"""Names of cells by their number of corners."""


def to_bytes(export: Export) -> bytes:
    """Return the struts as lines in mm, at rest or displaced, as a VTU file.

    Nodes have their role (1 free, 2 support, 3 input, 4 output) and displacement, beams have
    their number in the problem and whether they are designable.
    """
    part = export.part
    problem = part.design.problem
    rest = part.positions
    moved = rest if export.moved is None else export.moved * part.scale
    beam = np.flatnonzero(part.design.mask)
    designable = np.isin(beam, problem.designable)
    return mesh_to_bytes(
        moved,
        part.struts,
        {"displacement_mm": moved - rest, "role": _roles(part.design.problem)},
        {"beam": beam, "designable": designable.astype(np.int64)},
    )


def _roles(problem: Problem) -> NDArray[np.int64]:
    """(N,) role of each node: 1 free, 2 support, 3 input, 4 output."""
    roles = np.ones(problem.lattice.node_count, dtype=np.int64)
    for role, nodes in enumerate(
        (problem.supports.nodes, problem.input.nodes, problem.output.nodes), start=2
    ):
        roles[nodes] = role
    return roles


def mesh_to_bytes(
    points: Values, cells: Values, of_points: Mapping[str, Values], of_cells: Mapping[str, Values]
) -> bytes:
    """Return lines, triangles or tetrahedra with data as a VTU file.

    Parameters
    ----------
    points : (n, 2) or (n, 3)
        Vertices.
    cells : (c, 2), (c, 3) or (c, 4) int64
        Vertices of each line, triangle or tetrahedron.
    of_points, of_cells
        Data of vertices and cells by name, (n,) or (n, d) and (c,) or (c, d). Planar vectors
        (d = 2) are extended by a third component of 0.

    Raises
    ------
    InvalidSettings
        If meshio is not installed.
    """
    exporters["vtu"].check_installed()
    import meshio

    mesh = meshio.Mesh(
        _in_space(points),
        [(KINDS[cells.shape[1]], cells)],
        point_data={name: _in_space(values) for name, values in of_points.items()},
        cell_data={name: [_in_space(values)] for name, values in of_cells.items()},
    )
    # meshio writes to files only.
    with TemporaryDirectory() as folder:
        temporary = Path(folder) / "part.vtu"
        meshio.write(temporary, mesh, file_format="vtu")
        return temporary.read_bytes()


def _in_space(values: Values) -> Values:
    """Return planar vectors with a third component of 0, and other values unchanged."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    return values


exporters.register("vtu")(Exporter((".vtu",), to_bytes, "meshio", "files"))
