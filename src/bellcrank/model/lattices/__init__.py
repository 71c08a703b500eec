"""Generators of lattices, by name.

To add one, write a function that returns a `Lattice`, register it with
``@lattices.register("name")`` in a module of this folder, and import it below. Its parameters are
the keys of the ``[lattice]`` table of problem files. A generator that needs random numbers has a
parameter ``rng``, which is set from the key ``seed``. Generators check the number of nodes
(`check_node_count`) before they start.
"""

from bellcrank.model.lattices.crystals import body_centred, cubic, kelvin, octet
from bellcrank.model.lattices.delaunay import displaced_delaunay, displaced_delaunay_space
from bellcrank.model.lattices.given import given_nodes
from bellcrank.model.lattices.jammed import jammed_discs
from bellcrank.model.lattices.registry import lattices
from bellcrank.model.lattices.triangular import triangular_rectangle, triangular_rows

__all__ = [
    "body_centred",
    "cubic",
    "displaced_delaunay",
    "displaced_delaunay_space",
    "given_nodes",
    "jammed_discs",
    "kelvin",
    "lattices",
    "octet",
    "triangular_rectangle",
    "triangular_rows",
]
