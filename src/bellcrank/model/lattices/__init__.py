"""Generators of lattices, by name.

A new one is a function that returns a Lattice, in a file of its own, under
``@lattices.register("name")``, and imported below. Its parameters become the
keys of the ``[lattice]`` table in problem files; one that needs random numbers
takes ``rng``, for which the file says ``seed``.
"""

from bellcrank.model.lattices.delaunay import displaced_delaunay
from bellcrank.model.lattices.imported import imported
from bellcrank.model.lattices.jammed import jammed_discs
from bellcrank.model.lattices.registry import lattices
from bellcrank.model.lattices.triangular import triangular_rectangle, triangular_rows

__all__ = [
    "displaced_delaunay",
    "imported",
    "jammed_discs",
    "lattices",
    "triangular_rectangle",
    "triangular_rows",
]
