"""LAMMPS: data files with nodes and beams, and dumps of a motion, for LAMMPS and OVITO.

Both are in lattice units. A dump contains no beams: OVITO takes them from a data file of the same
part, to which the dump is added as a trajectory. Nodes have the same numbers in both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.export.formats.base import Export, Exporter, exporters
from bellcrank.model import Lattice, formats, network_of
from bellcrank.model.formats import Network

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FORMAT = formats["lammps"]


def data_to_bytes(export: Export) -> bytes:
    """Return the nodes and present beams, at rest or displaced, as a data file."""
    network = network_of(export.part.design)
    if export.moved is not None:
        network = Network(Lattice(export.moved, network.lattice.beams), network.roles)
    return _FORMAT.to_text(network).encode("utf-8")


def dump_to_bytes(export: Export) -> bytes:
    """Return the frames of a motion as a dump, or the nodes at rest and displaced."""
    frames = _frames(export)
    low, high = frames.min(axis=(0, 1)) - 0.5, frames.max(axis=(0, 1)) + 0.5
    box = "".join(
        f"{least!r} {most!r}\n"
        for least, most in zip([*low.tolist(), -0.5], [*high.tolist(), 0.5], strict=True)
    )
    roles = network_of(export.part.design).roles.tolist()
    return "".join(_frame(time, nodes, roles, box) for time, nodes in enumerate(frames)).encode()


def _frames(export: Export) -> NDArray[np.float64]:
    if export.frames is not None:
        return export.frames
    rest = export.part.design.problem.lattice.positions
    return np.stack([rest] if export.moved is None else [rest, export.moved])


def _frame(time: int, nodes: NDArray[np.float64], roles: list[int], box: str) -> str:
    rows = "".join(
        f"{number} {role} {x!r} {y!r} 0.0\n"
        for number, (role, (x, y)) in enumerate(zip(roles, nodes.tolist(), strict=True), start=1)
    )
    return (
        f"ITEM: TIMESTEP\n{time}\nITEM: NUMBER OF ATOMS\n{len(nodes)}\n"
        f"ITEM: BOX BOUNDS ff ff ff\n{box}ITEM: ATOMS id type x y z\n{rows}"
    )


exporters.register("lammps")(Exporter(_FORMAT.suffixes, data_to_bytes))
exporters.register("dump")(Exporter((".dump", ".lammpstrj"), dump_to_bytes))
