"""Frames: struts as beam elements with rigid joints."""

from bellcrank.fem.frame.level import analyse_frame
from bellcrank.fem.frame.mesh import theories

__all__ = ["analyse_frame", "theories"]
