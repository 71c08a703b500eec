"""Struts as they are printed: the whole outline of a part, in the plane or in space.

Quadratic finite elements (NGSolve) with supports and inputs that grip hubs, small discs round
the nodes of the lattice.
"""

from bellcrank.fem.continuum.level import analyse_plane, analyse_solid

__all__ = ["analyse_plane", "analyse_solid"]
