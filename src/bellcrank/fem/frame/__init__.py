"""Frames: struts as co-rotational beam elements with rigid joints."""

from bellcrank.fem.frame.analysis import analyse_frame

__all__ = ["analyse_frame"]
