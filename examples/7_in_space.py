"""
An actuator in space
====================

A column of struts that twists when it is compressed, from its task to a file for a printer.
"""

# %%
# The task
# --------
# Lengths are in millimetres; x points right, y back and z up. The column is a cylinder of octets
# that stand on a corner. Its lowest layer is fixed, the upper one is a solid plate. A third of a
# turn about its axis does not change the part, so that its axis stays straight.

from pathlib import Path

from bellcrank.export import check_print, export
from bellcrank.plots import draw_design, draw_motion
from bellcrank.search import HoppingSettings
from bellcrank.task import read_task
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.pictures import motion_of

Path("twist-column.toml").write_text("""
schema = "bellcrank/task/1"
name = "twist-column"

[part]
width = "2 mm"                          # diameter of the struts
spacing = "10 mm"                       # their length
material = "ninjaflex"

[domain]
size = ["33 mm", "33 mm", "52 mm"]
cells = { kind = "octet", up = [1, 1, 1], envelope = "cylinder" }
solid = [{ box = [0, 0, 45, 33, 33, 52] }]

[[supports]]
at = { face = "bottom" }

[[cases]]
inputs = [{ at = { point = [16.5, 16.5, 50] }, direction = "down", displacement = "3 mm" }]

[[cases.outputs]]
at = { face = "top", without = { cylinder = [16.5, 16.5], radius = "5 mm" } }
direction = "down"
rotation = { maximise = true, at_least = "24 deg" }
off_axis = "5%"

[limits]
symmetry = "3-fold"
""")
task = read_task("twist-column.toml")
lattice = task.problem.lattice
print(f"{lattice.node_count} nodes, {lattice.beam_count} struts")
draw_design(task.initial_design(), "column.png", title="the full lattice")

# %%
# The search
# ----------
# A short search decides which struts to keep. ``refine=False`` leaves out the refinement, which
# moves the nodes afterwards and takes some minutes (see :doc:`/refinement`).

settings = HoppingSettings(steps=300, chains=1)
folder = start_design(task.problem, settings, Path("column"), task.part, refine=False)
report = complete_design(folder)
design = report.selection.design
for model, items in report.items.items():
    for item in items:
        print(f"{model}: {item.item.quantity} {item.value:.3g}, met: {item.met}")
draw_motion(motion_of(design), "twisted.png", title="compressed by 3 mm")

# %%
# The file
# --------
# ``.3mf`` and ``.stl`` contain the union of all struts, closed and ready for a slicer, ``.step``
# the same for CAD, and ``.beams.3mf`` a beam for each strut. Flat struts need supports or a printer
# that prints in powder or resin.

part = task.part.of(design)
for warning in check_print(part):
    print(warning.sentence)
for name in ("column.3mf", "column.stl", "column.beams.3mf"):
    export(part, name)
    print(name, Path(name).stat().st_size // 1000, "kB")

# %%
# On the command line: ``bellcrank design twist-column.toml``, ``bellcrank export twist-column
# column.3mf``, ``bellcrank animate twist-column column.gif`` and ``bellcrank validate twist-column
# --level frame`` (:doc:`/tasks`).
