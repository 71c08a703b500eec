"""Compiled functions of frames."""
