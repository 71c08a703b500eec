"""Whole jobs of the learned surrogate: building data, searching, explaining, comparing."""
