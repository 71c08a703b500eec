"""
Print it
========

A design becomes a part: struts of some width, a thickness, a scale, a material.
"""

# %%
# How large
# ---------
# One lattice unit becomes ``scale``; lengths are in millimetres.

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
for finding in check_print(part):
    print(finding.sentence)

# %%
# Does the part move like that?
# -----------------------------
# Finite elements of the struts, bent and stretched along the whole stroke, answer in a second
# (see :doc:`/validation` for plane and solid ones).

validation = validate(crane, spec, [("frame", FemSettings())])
frame = validation.analyses[0]
print(f"springs {validation.response.efficiency:.2f}, frame {frame.efficiency:.2f}")
draw_validations([validation], ["machine:crane"], Path("stress.png"))

# %%
# Files
# -----
# The suffix says what is written: ``.stl`` and ``.3mf`` for printers, ``.dxf``, ``.svg`` and
# ``.step`` for cutters and drawings.

for name in ("crane.3mf", "crane.stl", "crane.dxf"):
    export(part, name)
    print(name, Path(name).stat().st_size // 1000, "kB")

# %%
# A card goes with the part: how it moves, how large and heavy it is, how to print it.

make_card(crane, spec, Path("card.png"))

# %%
# On the command line: ``bellcrank validate machine:crane``, ``bellcrank export machine:crane
# crane.3mf``, ``bellcrank card machine:crane card.pdf`` (:doc:`/fabrication`).
