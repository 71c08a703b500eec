"""
Your own problem
================

A problem is a lattice with supports, an input and an output.
"""

# %%
# In a file
# ---------
# Regions are rows, boxes, nearest nodes or node numbers. Lengths are in lattice units.

from pathlib import Path

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem
from bellcrank.plots import draw_design, draw_motion
from bellcrank.search import HoppingSettings
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.pictures import motion_of

Path("lift.toml").write_text("""
schema = "bellcrank/problem/1"
name = "lift"

[lattice]
kind = "triangular-rows"
counts = [8, 9, 8, 9, 8, 9]             # nodes in each row, from the bottom
first_x = [0.5, 0.0, 0.5, 0.0, 0.5, 0.0]

[supports]
fixed = [{ row = 0 }]

[input]
nodes = [{ row = -1, rightmost = 2 }]
direction = [0, -1]
drive = "displacement"
amount = 0.2

[output]
nodes = [{ row = -1, leftmost = 2 }]
direction = [0, 1]
""")
lift = find_problem("lift.toml")
draw_design(lift.full_design(), "task.png", title="the problem")

# %%
# The full lattice is stiff, and its output hardly moves.

whole = SpringEvaluator(lift).evaluate(lift.initial)
print(f"all beams: efficiency {whole.efficiency:.3f}")

# %%
# Goals
# -----
# Constraints are written as text (see :doc:`/goals`): here, at most two thirds of the material, and
# a strain of at most 0.1 in each beam.

settings = HoppingSettings(
    steps=3000, chains=1, seed=3, goals=("mass <= 0.67", "strain <= 0.1", "connected")
)
report = complete_design(start_design(lift, settings, Path("lift")))
found = report.selection
print(f"efficiency {found.efficiency_after:.2f}, {found.design.beam_count} beams")
draw_motion(motion_of(found.design), "moved.png", title="lift")
