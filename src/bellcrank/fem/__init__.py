"""Finite elements of parts: frames of beams, plane stress and solids.

>>> from bellcrank.fem import FemSettings, levels
>>> from bellcrank.model import human_design
>>> from bellcrank.part import PartSpec
>>> part = PartSpec(width=2.0).of(human_design("crane"))
>>> analysis = levels["frame"](part, FemSettings())
>>> analysis.status.value, round(analysis.efficiency, 3)
('converged', 1.176)
"""

from bellcrank.fem import frame  # isort: skip
from bellcrank.fem import continuum  # isort: skip
from bellcrank.fem.contact import Contacts, find_contacts
from bellcrank.fem.levels import FemSettings, levels
from bellcrank.fem.path import PathStatus, StabilityLoss
from bellcrank.fem.results import Analysis, Field, StrokePoint

__all__ = [
    "Analysis",
    "Contacts",
    "FemSettings",
    "Field",
    "PathStatus",
    "StabilityLoss",
    "StrokePoint",
    "continuum",
    "find_contacts",
    "frame",
    "levels",
]
