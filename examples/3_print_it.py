"""
Export and printing
===================

From a design to a file for the printer. The design is an entry of the library of actuators, whose
struts have widths of their own.
"""

# %%
# The part
# --------
# A part is a design with a thickness, a scale and a material; ``scale`` is the spacing of the
# nodes, and lengths are in millimetres. The specification of the entry is for this part.

from pathlib import Path

from bellcrank.export import check_print, export
from bellcrank.fem import FemSettings
from bellcrank.machines.library import library
from bellcrank.workflows import spec_for, validate
from bellcrank.workflows.card import make_card
from bellcrank.workflows.pictures import draw_validations

design = library().find("up-7-straight-10g").design
spec = spec_for(design)
print(spec)
part = spec.of(design)
for warning in check_print(part):
    print(warning.sentence)

# %%
# Validation
# ----------
# Nonlinear beam finite elements compute the motion of the part along the whole stroke in about a
# second (see :doc:`/validation` for plane and solid elements).

validation = validate(design, spec, [("frame", FemSettings())])
frame = validation.analyses[0]
print(f"gain as searched {validation.response.efficiency:.2f}, by frames {frame.efficiency:.2f}")
print(f"input force {frame.last.push:.2f} N, largest stress {frame.last.stress:.2f} MPa")
draw_validations([validation], ["up-7"], Path("stress.png"))

# %%
# Files
# -----
# The suffix determines the format: ``.stl`` and ``.3mf`` for printers, ``.dxf``, ``.svg`` and
# ``.step`` for cutters and drawings.

for name in ("up-7.3mf", "up-7.stl", "up-7.dxf"):
    export(part, name)
    print(name, Path(name).stat().st_size // 1000, "kB")

# %%
# The card of the part shows its motion, size, mass and print settings.

make_card(design, spec, Path("card.png"))

# %%
# On the command line: ``bellcrank validate``, ``bellcrank export``, ``bellcrank card`` with
# ``library:up-7-straight-10g-4b5334cf`` (:doc:`/fabrication`).
