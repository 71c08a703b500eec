"""
A first design
==============

A lattice of beams is pushed down on its right; its top left should move to the left. Which beams
should be there?
"""

# %%
# The task
# --------
# Some problems come with the package. This one is called the crane: 352 beams, of which a search
# may take away 203.

from pathlib import Path

from bellcrank.model import find_problem, human_design
from bellcrank.plots import draw_comparison
from bellcrank.search import HoppingSettings
from bellcrank.workflows import complete_design, motion_of, start_design

crane = find_problem("crane")
print(crane.lattice.beam_count, "beams, of which", len(crane.designable), "may go")

# %%
# Searching
# ---------
# A search runs in a folder, from which it goes on after any interruption. More steps and more
# chains find better designs; ``bellcrank design crane`` takes four chains of 20,000.

folder = start_design(crane, HoppingSettings(steps=4000, chains=1, seed=1), Path("crane"))
report = complete_design(folder)
machine = report.selection.design

# %%
# What it found
# -------------
# The *efficiency* is how far the output goes, the wanted way, over how far the input is pushed.
# Beside it, a lever that a person cut out of the same lattice.

print(f"machine {report.selection.efficiency_after:.2f}, {machine.beam_count} beams")
print(f"human   {report.human_response.efficiency:.2f}")

# %%
# Grey is at rest, black is pushed.

draw_comparison(
    motion_of(human_design("crane"), name="human"),
    motion_of(machine, name="machine"),
    "comparison.png",
)

# %%
# On the command line, all of that is ``bellcrank design crane``.
