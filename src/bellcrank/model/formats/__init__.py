"""Exchange formats for lattices, one module for each.

To add one, register a `LatticeFormat` with ``formats.register("name")`` in a module of this folder
and import it below. The contract test writes and reads every registered format.

Examples
--------
>>> from tempfile import TemporaryDirectory
>>> from bellcrank.model import find_problem
>>> design = find_problem("scaling-8").full_design()
>>> with TemporaryDirectory() as folder:
...     write_network(network_of(design), f"{folder}/design.lammps")
...     network = read_network(f"{folder}/design.lammps")
>>> network.lattice.beam_count, int((network.roles == NodeRole.SUPPORT).sum())
(219, 8)
"""

from bellcrank.model.formats import lammps
from bellcrank.model.formats.network import (
    LatticeFormat,
    Network,
    NodeRole,
    formats,
    network_of,
    read_network,
    write_network,
)

__all__ = [
    "LatticeFormat",
    "Network",
    "NodeRole",
    "formats",
    "lammps",
    "network_of",
    "read_network",
    "write_network",
]
