"""VTU: the lattice with what is known of its nodes and beams, for ParaView."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bellcrank.fabricate.formats.base import Export, Exporter, exporters
from bellcrank.model import network_of


def to_bytes(export: Export) -> bytes:
    """Return the struts as lines in mm, at rest or where they have moved, as a VTU file.

    Nodes have their role (1 free, 2 support, 3 input, 4 output) and their displacement, beams
    their number in the problem and whether a search may change them.
    """
    import meshio

    part = export.part
    problem = part.design.problem
    rest = part.positions
    moved = rest if export.moved is None else export.moved * part.scale
    beam = np.flatnonzero(part.design.mask)
    designable = np.isin(beam, problem.designable)
    mesh = meshio.Mesh(
        _in_space(moved),
        [("line", part.struts)],
        point_data={
            "displacement_mm": _in_space(moved - rest),
            "role": network_of(part.design).roles,
        },
        cell_data={"beam": [beam], "designable": [designable.astype(np.int64)]},
    )
    # meshio writes to files only.
    with TemporaryDirectory() as folder:
        temporary = Path(folder) / "part.vtu"
        meshio.write(temporary, mesh, file_format="vtu")
        return temporary.read_bytes()


def _in_space(
    plane: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.column_stack([plane, np.zeros(len(plane))])


exporters.register("vtu")(Exporter((".vtu",), to_bytes, "the lattice for ParaView"))
