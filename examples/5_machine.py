"""
A machine of several actuators
==============================

Actuators can drive each other. The motion of each then depends on the load at its output.
"""

# %%
# Parts
# -----
# The bundled library contains actuators by direction, size and kind. The first stage needs a loaded
# output, the last stage a low input force.

from pathlib import Path

from bellcrank.machines import assemble, mean_ports, predict, two_port_at
from bellcrank.machines.library import library
from bellcrank.machines.plan import read_plan
from bellcrank.mechanics import model_evaluator
from bellcrank.plots import draw_motion
from bellcrank.workflows.pictures import motion_of

loaded = library().find("down-9-loaded").design
light = library().find("down-9-light").design

for name, design in (("loaded output", loaded), ("low input force", light)):
    element = mean_ports(design)
    port = two_port_at(element, element.rest())
    print(
        f"{name}: efficiency {port.efficiency:.2f}, input stiffness {port.input_stiffness:.2f}, "
        f"output stiffness {1 / port.output_compliance:.4f}"
    )

# %%
# Estimate from the two-ports: the output of the first stage works against the input of the second.

first, second = (two_port_at(e, e.rest()) for e in (mean_ports(loaded), mean_ports(light)))
gain = first.efficiency_against(second.input_stiffness) * second.efficiency
print(f"about {gain:.1f}")

# %%
# A plan
# ------

Path("two-stage.toml").write_text("""
name = "two-stage"

[parts.first]
entry = "down-9-loaded"

[parts.second]
entry = "down-9-light"
join = "first.output"

[input]
ports = ["first.input"]

[output]
ports = ["second.output"]
""")
machine = assemble(read_plan("two-stage.toml"), lambda entry: library().find(entry).design)
print(f"predicted from its parts: {predict(machine).efficiency[-1]:.2f}")

# %%
# One lattice
# -----------
# The machine is an ordinary design, which every command accepts.

evaluator = model_evaluator(machine.design.problem)
response = evaluator.evaluate(machine.design.mask)
print(f"simulation at the full stroke: {response.efficiency:.2f}")
draw_motion(motion_of(machine.design), "two-stage.png", title="two stages")

# %%
# ``bellcrank machine build two-stage.toml`` writes the design; ``bellcrank design --from
# two-stage.json`` starts a search from it, over the beams of the whole machine.
