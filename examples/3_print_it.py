"""
Export and printing
===================

A part is a design with a strut width, a thickness, a scale and a material.
"""

# %%
# The part
# --------
# ``scale`` is the length of a lattice unit; lengths are in millimetres.

from pathlib import Path

from bellcrank.export import check_print, export
from bellcrank.fem import FemSettings
from bellcrank.model import gallery_design
from bellcrank.part import PartSpec
from bellcrank.workflows import validate
from bellcrank.workflows.card import make_card
from bellcrank.workflows.pictures import draw_validations

crane = gallery_design("machine", "crane")
spec = PartSpec(width=1.6, thickness=5.0, scale=10.0, material="ninjaflex")
part = spec.of(crane)
for warning in check_print(part):
    print(warning.sentence)

# %%
# Validation
# ----------
# Nonlinear beam finite elements compute the motion of the part along the whole stroke in about a
# second (see :doc:`/validation` for plane and solid elements).

validation = validate(crane, spec, [("frame", FemSettings())])
frame = validation.analyses[0]
print(f"springs {validation.response.efficiency:.2f}, frame {frame.efficiency:.2f}")
draw_validations([validation], ["machine:crane"], Path("stress.png"))

# %%
# Files
# -----
# The suffix determines the format: ``.stl`` and ``.3mf`` for printers, ``.dxf``, ``.svg`` and
# ``.step`` for cutters and drawings.

for name in ("crane.3mf", "crane.stl", "crane.dxf"):
    export(part, name)
    print(name, Path(name).stat().st_size // 1000, "kB")

# %%
# The card of the part shows its motion, size, mass and print settings.

make_card(crane, spec, Path("card.png"))

# %%
# On the command line: ``bellcrank validate machine:crane``, ``bellcrank export machine:crane
# crane.3mf``, ``bellcrank card machine:crane card.pdf`` (:doc:`/fabrication`).
