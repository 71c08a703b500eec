"""Quantities of a frame: motion of its output, forces, strain.

A quantity is a function of a few *measures*: numbers that change linearly with the equilibrium to
first order, such as the mean displacement of the output. The change of measures by flips follows
from one Newton step; the function that combines them to the quantity is evaluated exactly.
"""

from bellcrank.mechanics.frames.quantities import forces, motion, strain
from bellcrank.mechanics.frames.quantities.definition import (
    Load,
    Measures,
    Quantity,
    Slopes,
    quantities,
)

__all__ = ["Load", "Measures", "Quantity", "Slopes", "forces", "motion", "quantities", "strain"]
