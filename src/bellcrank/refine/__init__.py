"""Refinement: positions of nodes and widths of struts by gradients.

A search decides which beams there are. Refinement then moves the nodes of a design, and may change
the widths of its struts, so that its specification is met and its objective grows. Objectives and
constraints are those of the specification, gaps along the stroke, the stability of all paths, and
what prints; all have adjoint gradients (`bellcrank.mechanics.frames.geometry`). Steps are linear
programs within a trust region.

>>> from bellcrank.part import PartSpec, frame_problem
>>> from bellcrank.model import human_design
>>> from dataclasses import replace
>>> design = human_design("crane")
>>> design = replace(design, problem=frame_problem(design.problem, PartSpec()))
>>> refined = refine_design(design, RefinementSettings(steps=3))
>>> refined.after.objective > refined.before.objective
True
"""

from bellcrank.refine.design import Refinement, refine_design
from bellcrank.refine.refinement import RefinementSettings

__all__ = ["Refinement", "RefinementSettings", "refine_design"]
