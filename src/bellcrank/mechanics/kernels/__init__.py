"""Compiled kernels: plain arrays in, plain arrays out, no validation, no allocation.

Reading order: `arrays` (the bundles of arrays), `core` and `structure` (the part of a design
that carries load), `pattern` (the pattern of the stiffness), `energy` (energy, gradient,
stiffness), `cholesky` (sparse factorisation in 2 x 2 blocks), `newton` (equilibrium at a fixed
load), `tangents` and `loading` (the path from rest to full load), `branch` and `response` (the
response of a design, from rest or from a reference), `flip_prediction` (change of the efficiency
by flips), `condensation` (stiffness seen at boundary nodes).
"""
