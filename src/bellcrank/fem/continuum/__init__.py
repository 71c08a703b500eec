"""Continua: the printed outline of a part in plane stress or as a solid.

Quadratic finite elements (NGSolve). Supports and inputs act on hubs, small discs around the lattice
nodes.
"""

from bellcrank.fem.continuum.analysis import analyse_plane, analyse_solid

__all__ = ["analyse_plane", "analyse_solid"]
