"""A printed triangular lattice that others measured, by springs, frames and the sheet."""
