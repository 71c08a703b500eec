"""Parts: designs with a size, a strut cross-section and a material.

>>> from bellcrank.model import find_problem
>>> from bellcrank.part import PartSpec
>>> part = PartSpec(width=1.6).of(find_problem("crane").full_design())
>>> part.material.name, round(part.stroke, 2)
('ninjaflex', 4.33)
"""

from bellcrank.model.section import Section
from bellcrank.part.frames import (
    frame_elasticity,
    frame_problem,
    frame_section,
    models,
    spring_problem,
)
from bellcrank.part.materials import Material, materials
from bellcrank.part.part import Part
from bellcrank.part.spec import PartSpec, read_part
from bellcrank.part.units import read_length, read_quantity

__all__ = [
    "Material",
    "Part",
    "PartSpec",
    "Section",
    "frame_elasticity",
    "frame_problem",
    "frame_section",
    "materials",
    "models",
    "read_length",
    "read_part",
    "read_quantity",
    "spring_problem",
]
