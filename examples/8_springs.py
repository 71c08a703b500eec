"""
The springs of the paper
========================

The paper of Bonfanti et al. (Nat. Commun. 2020) models a lattice by springs: one in each beam, and
angular springs between neighbouring beams. Its designs have no width yet, and the search maximises
a displacement ratio only. Such a search is fast, and its designs are seldom parts that work; the
other tutorials design frames to a specification.
"""

# %%
# The crane of the paper
# ----------------------
# The upper right of a lattice is pushed down, and its upper left is to move to the left: 352 beams,
# of which a search may remove 203. The *efficiency* is the displacement of the output in the wanted
# direction divided by the displacement of the input.

from pathlib import Path

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem, human_design
from bellcrank.plots import draw_comparison, draw_design, draw_motion
from bellcrank.search import HoppingSettings
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.pictures import motion_of

crane = find_problem("crane")
folder = start_design(crane, HoppingSettings(steps=4000, chains=1, seed=1), Path("crane"))
report = complete_design(folder)
machine = report.selection.design
print(f"machine {report.selection.efficiency_after:.2f}, {machine.beam_count} beams")
print(f"human   {report.human_response.efficiency:.2f}")

# %%
# The human design is a lever drawn by hand in the same lattice. The designs are drawn at rest in
# grey and at full stroke in black.

draw_comparison(
    motion_of(human_design("crane"), name="human"),
    motion_of(machine, name="machine"),
    "comparison.png",
)

# %%
# A problem in a file
# -------------------
# A problem is a lattice with supports, an input and an output, in lattice units. Regions are rows,
# boxes, nearest nodes or node numbers.

Path("rows.toml").write_text("""
schema = "bellcrank/problem/1"
name = "rows"

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
rows = find_problem("rows.toml")
draw_design(rows.full_design(), "rows-full.png", title="the problem")

# %%
# The full lattice is stiff, and its output hardly moves.

whole = SpringEvaluator(rows).evaluate(rows.initial)
print(f"all beams: efficiency {whole.efficiency:.3f}")

# %%
# Goals
# -----
# Constraints are written as text (see :doc:`/goals`): here, at most two thirds of the material, and
# a strain of at most 0.1 in each beam.

settings = HoppingSettings(
    steps=3000, chains=1, seed=3, goals=("mass <= 0.67", "strain <= 0.1", "connected")
)
report = complete_design(start_design(rows, settings, Path("rows")))
found = report.selection
print(f"efficiency {found.efficiency_after:.2f}, {found.design.beam_count} beams")
draw_motion(motion_of(found.design), "rows.png", title="rows")

# %%
# ``bellcrank design crane --paper`` uses the Metropolis chain of the paper.
