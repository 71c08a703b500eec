"""
A first design
==============

The upper right of a lattice of beams is pushed down, and its upper left is to move to the left. A
search selects the beams.
"""

# %%
# The problem
# -----------
# The crane is a bundled problem: 352 beams, of which a search may remove 203.

from pathlib import Path

from bellcrank.model import find_problem, human_design
from bellcrank.plots import draw_comparison
from bellcrank.search import HoppingSettings
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.pictures import motion_of

crane = find_problem("crane")
print(crane.lattice.beam_count, "beams, of which", len(crane.designable), "are designable")

# %%
# Searching
# ---------
# A search is stored in a folder, from which it can be resumed after an interruption. More steps and
# chains find better designs; ``bellcrank design crane`` runs four chains of 20,000 steps.

folder = start_design(crane, HoppingSettings(steps=4000, chains=1, seed=1), Path("crane"))
report = complete_design(folder)
machine = report.selection.design

# %%
# The result
# ----------
# The *efficiency* is the displacement of the output in the wanted direction divided by the
# displacement of the input. The human design is a lever drawn by hand in the same lattice.

print(f"machine {report.selection.efficiency_after:.2f}, {machine.beam_count} beams")
print(f"human   {report.human_response.efficiency:.2f}")

# %%
# The designs are drawn at rest in grey and at full stroke in black.

draw_comparison(
    motion_of(human_design("crane"), name="human"),
    motion_of(machine, name="machine"),
    "comparison.png",
)

# %%
# The command ``bellcrank design crane`` does all of this.
