"""Frames: struts as co-rotational beam elements with rigid joints."""

from bellcrank.fem.frame.analysis import analyse_frame
from bellcrank.fem.frame.mesh import theories

__all__ = ["analyse_frame", "theories"]
