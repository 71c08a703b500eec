"""
A machine of several actuators
==============================

Actuators can drive each other. What one does then depends on what it pushes against.
"""

# %%
# Parts
# -----
# The library that comes along holds actuators by direction, size and kind. One is made to be
# strong, another to be easy to drive.

from pathlib import Path

from bellcrank.machines import assemble, mean_ports, predict, two_port_at
from bellcrank.machines.library import library
from bellcrank.machines.plan import read_plan
from bellcrank.mechanics import SpringEvaluator
from bellcrank.plots import draw_motion
from bellcrank.workflows import motion_of

strong = library().find("down-9-loaded").design
easy = library().find("down-9-light").design

for name, design in (("strong", strong), ("easy", easy)):
    element = mean_ports(design)
    port = two_port_at(element, element.rest())
    print(
        f"{name}: efficiency {port.efficiency:.2f}, input stiffness {port.input_stiffness:.2f}, "
        f"output stiffness {1 / port.output_compliance:.4f}"
    )

# %%
# What the two-ports foretell: the first one's output against the second one's input.

first, second = (two_port_at(e, e.rest()) for e in (mean_ports(strong), mean_ports(easy)))
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
print(f"by all nodes of the ports: {predict(machine).efficiency:.2f}")

# %%
# One lattice
# -----------
# The machine is an ordinary design: one piece, which every other command takes.

response = SpringEvaluator(machine.design.problem).evaluate(machine.design.mask)
print(f"the whole lattice, along its whole stroke: {response.efficiency:.2f}")
draw_motion(motion_of(machine.design), "two-stage.png", title="two stages")

# %%
# ``bellcrank machine build two-stage.toml`` writes it; ``bellcrank design --from two-stage.json``
# searches on from there, over the beams of the whole machine.
