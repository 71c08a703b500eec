"""Actuators as others meet them, two-ports at rest and along the stroke, and machines of them.

The work flow, in four lines:

>>> from bellcrank.machines import characterise
>>> from bellcrank.model import human_design
>>> lever = characterise(human_design("crane"), points=2)
>>> print(f"{lever.rest.efficiency:.3f} free, {lever.rest.efficiency_against(0.1):.3f} loaded")
0.818 free, 0.456 loaded
"""

from bellcrank.machines.assembly import Machine, assemble
from bellcrank.machines.chaining import Prediction, predict
from bellcrank.machines.characterise import Characterisation, characterise, usual_loads
from bellcrank.machines.checking import Check, compare, foretold_to_dict, simulate
from bellcrank.machines.curves import PortCurve, trace
from bellcrank.machines.elementary import DIRECTIONS, elementary, strut
from bellcrank.machines.foretelling import Foretold, foretell
from bellcrank.machines.loads import Load
from bellcrank.machines.plan import Plan, read_plan
from bellcrank.machines.ports import INPUT, OUTPUT, Port, block_ports, mean_ports, ports_of
from bellcrank.machines.potential import Potential, fit_potential
from bellcrank.machines.record import (
    characterisation_from_dict,
    characterisation_to_dict,
    read_characterisation,
    write_characterisation,
)
from bellcrank.machines.sampling import Fit, Reach, fit, sample, usual_reach
from bellcrank.machines.two_port import TwoPort, two_port_at

__all__ = [
    "DIRECTIONS",
    "INPUT",
    "OUTPUT",
    "Characterisation",
    "Check",
    "Fit",
    "Foretold",
    "Load",
    "Machine",
    "Plan",
    "Port",
    "PortCurve",
    "Potential",
    "Prediction",
    "Reach",
    "TwoPort",
    "assemble",
    "block_ports",
    "characterisation_from_dict",
    "characterisation_to_dict",
    "characterise",
    "compare",
    "elementary",
    "fit",
    "fit_potential",
    "foretell",
    "foretold_to_dict",
    "mean_ports",
    "ports_of",
    "predict",
    "read_characterisation",
    "read_plan",
    "sample",
    "simulate",
    "strut",
    "trace",
    "two_port_at",
    "usual_loads",
    "usual_reach",
    "write_characterisation",
]
