"""Finite elements, which tell whether a part moves as the model of its design says."""
