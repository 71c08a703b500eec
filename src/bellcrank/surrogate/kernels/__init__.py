"""Compiled kernels of the surrogate: plain arrays in, plain arrays out."""
