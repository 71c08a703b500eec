"""LAMMPS data files: nodes and beams in lattice units, for LAMMPS and OVITO."""

from __future__ import annotations

from bellcrank.export.formats.base import Export, Exporter, exporters
from bellcrank.model import Lattice, formats, network_of
from bellcrank.model.formats import Network

_FORMAT = formats["lammps"]


def to_bytes(export: Export) -> bytes:
    """Return the nodes and the beams that are present, at rest or where they have moved."""
    network = network_of(export.part.design)
    if export.moved is not None:
        network = Network(Lattice(export.moved, network.lattice.beams), network.roles)
    return _FORMAT.to_text(network).encode("utf-8")


exporters.register("lammps")(Exporter(_FORMAT.suffixes, to_bytes))
