"""
A machine of several actuators
==============================

Actuators can drive each other. The motion of each then depends on the load at its output.
"""

# %%
# Parts
# -----
# The bundled library contains actuators by direction, size and payload. The first stage works
# against the input of the second one, and needs a larger payload.

from pathlib import Path

from bellcrank.machines import assemble, mean_ports, predict, two_port_at
from bellcrank.machines.library import library
from bellcrank.machines.plan import read_plan
from bellcrank.mechanics import model_evaluator
from bellcrank.plots import draw_motion
from bellcrank.workflows.pictures import motion_of

strong = library().find("up-12-straight-200g").design
wide = library().find("left-12-straight-10g").design

for name, design in (("first stage", strong), ("second stage", wide)):
    element = mean_ports(design)
    port = two_port_at(element, element.rest())
    print(
        f"{name}: efficiency {port.efficiency:.2f}, input stiffness {port.input_stiffness:.2f}, "
        f"output stiffness {1 / port.output_compliance:.4f}"
    )

# %%
# Estimate from the two-ports: the output of the first stage works against the input of the second.

first, second = (two_port_at(e, e.rest()) for e in (mean_ports(strong), mean_ports(wide)))
gain = first.efficiency_against(second.input_stiffness) * second.efficiency
print(f"about {gain:.1f} for small strokes")

# %%
# A plan
# ------
# The second actuator is turned so that the first one pushes its input along its direction.

Path("two-stage.toml").write_text("""
name = "two-stage"

[parts.first]
entry = "up-12-straight-200g"

[parts.second]
entry = "left-12-straight-10g"
join = "first.output"
mirror = true
rotate = 180

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
