"""Parts: designs with a size, a strut cross-section and a material.

>>> from bellcrank.model import find_problem
>>> from bellcrank.part import PartSpec
>>> part = PartSpec(width=1.6).of(find_problem("crane").full_design())
>>> part.material.name, round(part.stroke, 2)
('ninjaflex', 4.33)
"""

from bellcrank.part.calibration import calibrated
from bellcrank.part.lengths import read_length
from bellcrank.part.materials import Material, materials
from bellcrank.part.part import Part
from bellcrank.part.section import Section
from bellcrank.part.spec import PartSpec, read_part

__all__ = [
    "Material",
    "Part",
    "PartSpec",
    "Section",
    "calibrated",
    "materials",
    "read_length",
    "read_part",
]
