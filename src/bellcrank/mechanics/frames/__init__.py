"""Frames: beams with bending and rigid joints, in the plane and in space.

Displacements and rotations are large, strains within a beam are small (co-rotational beams).
"""
