"""Compiled loops of the surrogate: plain arrays in, arrays out."""
