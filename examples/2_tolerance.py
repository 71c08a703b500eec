"""
As printed, not only as drawn
=============================

Prints deviate from their drawings. This page computes what that does to a part.
"""

# %%
# The part
# --------
# An entry of the library of actuators (:doc:`/library/README`): its input on the right is pushed
# down, and its output on the left moves up, straight, with a payload of 0.1 N. ``straight_motion``
# is the specification of these entries.

from dataclasses import replace

from bellcrank.machines.library import library
from bellcrank.machines.library.tasks import straight_motion
from bellcrank.plots import draw_critical_struts, draw_motion
from bellcrank.tolerance import Deviations
from bellcrank.workflows import spec_for
from bellcrank.workflows.part_figures import part_figures
from bellcrank.workflows.pictures import motion_of
from bellcrank.workflows.tolerance import compute_tolerance, tolerance_rows, tolerance_sentence

entry = library().find("up-7-straight-10g").design
spec = spec_for(entry)
design = replace(entry, problem=straight_motion(entry.problem, 0.1, spec))
draw_motion(motion_of(design), "up.png", title="up-7-straight-10g")

# %%
# As drawn
# --------
# The figures of the part, by frames of eight elements in each strut. The payload grows with the
# stroke; the dead load hangs on the output before the push. Each halves the travel.

(figures,) = part_figures(design, spec)
for name in ("travel_mm", "off_axis", "rotation_deg", "sag_mm", "payload_N", "dead_load_N"):
    print(f"{name}: {figures[name]:.3g}")

# %%
# As printed
# ----------
# Scenarios: all struts 20 % wider and narrower, the input 5 degrees off its direction, a longer
# and a shorter stroke, random prints whose nodes and widths deviate, and the loss of each strut.

report = compute_tolerance(design, Deviations(prints=40), spec, workers=1)
print(tolerance_sentence(report))
for row in tolerance_rows(report):
    print(" | ".join(row))

# %%
# Each strut is coloured by the part of the gain that its loss costs.

draw_critical_struts(report.design, report.tolerance.strut_losses(), "losses.png")

# %%
# On the command line: ``bellcrank tolerance NAME``. A table ``[tolerance]`` in a task makes search
# and refinement maximise the worst case (:doc:`/tolerance`).
