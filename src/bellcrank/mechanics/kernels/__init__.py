"""Compiled kernels: plain arrays in, plain arrays out, no validation, no allocation.

Read them in this order: `arrays` (what the arrays are), `structure` (which part
of a design carries load), `energy` (energy, gradient, Hessian), `cholesky`
(sparse factorisation in 2 x 2 blocks), `newton` and `relaxation` (minimisers at a
fixed load), `loading` (the way from rest to the full load), `response`
(efficiency of a design, from rest or from a neighbouring design).
"""
