"""
A first part
============

A part of 72 x 63 mm that stands on its lower edge. Its upper right corner is pushed down by 2 mm,
and its upper left corner is to move up as far as possible, straight, with a weight of 20 g on it.
"""

# %%
# The task
# --------
# A task says what the part must do, in mm, N and degrees (:doc:`/tasks`).

from dataclasses import replace
from pathlib import Path

from bellcrank.fem import FemSettings
from bellcrank.plots import draw_design, draw_motion
from bellcrank.refine import RefinementSettings, refine_design
from bellcrank.search import HoppingSettings
from bellcrank.task import read_task
from bellcrank.workflows import complete_design, start_design, validate
from bellcrank.workflows.pictures import motion_of
from bellcrank.workflows.specification import item_rows

Path("lift.toml").write_text("""
schema = "bellcrank/task/1"
name = "lift"

[domain]
size = ["72 mm", "63 mm"]

[[supports]]
at = { edge = "bottom" }

[[cases]]
inputs = [{ at = { point = [71, 61], count = 2 }, direction = "down", displacement = "2 mm" }]

[[cases.outputs]]
at = { point = [1, 61], count = 2 }
direction = "up"
gain = "maximise"                       # motion of the output over that of the input
off_axis = "10%"                        # motion across the direction, as a part of the travel
rotation = "5 deg"
dead_load = "20 g"                      # a weight that acts before the push and during it
""")
task = read_task("lift.toml")
lattice = task.problem.lattice
print(f"{lattice.node_count} nodes, {lattice.beam_count} struts")
draw_design(task.initial_design(), "lattice.png", title="the full lattice")

# %%
# The search
# ----------
# A search decides which struts to keep. Its designs are frames: struts that stretch, shear and
# bend, with large displacements. It is stored in a folder, from which it can be resumed.
# ``refine=False`` leaves the refinement for the next section.

settings = HoppingSettings(steps=1000, chains=1, seed=2)
folder = start_design(task.problem, settings, Path("lift"), task.part, refine=False)
report = complete_design(folder)
found = report.selection.design
print(f"gain {report.selection.efficiency_after:.2f}, {found.beam_count} struts")
for row in item_rows(task.problem, task.part, report.items):
    print(" | ".join(row))

# %%
# The refinement
# --------------
# Gradients of all figures with respect to the positions of the nodes and to the widths of the
# struts improve the design (:doc:`/refinement`).

limit = task.part.registered_material.strain_limit
refined = refine_design(found, RefinementSettings(evaluations=40, prints=0), strain_limit=limit)
design = replace(refined.design, provenance={"part": task.part.to_dict()})
print(f"gain {refined.before.objective:.2f} before, {refined.after.objective:.2f} after")
draw_motion(motion_of(design), "moved.png", title="pushed by 2 mm")

# %%
# The check
# ---------
# Finite elements of the printed outline, the *sheet*, compute the same items once more
# (:doc:`/validation`). A bound that frames meet narrowly may be missed here.

validation = validate(design, task.part, [("plane", FemSettings())])
for row in item_rows(task.problem, task.part, validation.items):
    print(" | ".join(row))

# %%
# The command ``bellcrank design lift.toml`` does all of this with a longer search, refines several
# designs, also with the sheet, and selects the best one that meets all items.
