"""VTU: the lattice with what is known of its nodes and beams, for ParaView."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.export.formats.base import Export, Exporter, exporters
from bellcrank.model import network_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    Values = NDArray[Any]

KINDS = {2: "line", 3: "triangle", 4: "tetra"}
"""Names of cells by their number of corners."""


def to_bytes(export: Export) -> bytes:
    """Return the struts as lines in mm, at rest or where they have moved, as a VTU file.

    Nodes have their role (1 free, 2 support, 3 input, 4 output) and their displacement, beams
    their number in the problem and whether a search may change them.
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
        {"displacement_mm": moved - rest, "role": network_of(part.design).roles},
        {"beam": beam, "designable": designable.astype(np.int64)},
    )


def mesh_to_bytes(
    points: Values, cells: Values, of_points: Mapping[str, Values], of_cells: Mapping[str, Values]
) -> bytes:
    """Return lines, triangles or tetrahedra with what is known of them as a VTU file.

    Parameters
    ----------
    points : (n, 2) or (n, 3)
    cells : (c, 2), (c, 3) or (c, 4) int64
    of_points, of_cells
        (n,) or (n, d), and (c,) or (c, d) each, by name; d of 2 becomes 3.
    """
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
    """Return vectors in the plane with a third coordinate of 0, and all else as it is."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    return values


exporters.register("vtu")(Exporter((".vtu",), to_bytes))
