"""Actuators as two-ports, a library of elementary actuators, and machines assembled from them.

The workflow for one actuator:

>>> from bellcrank.machines import characterise
>>> from bellcrank.model import human_design
>>> lever = characterise(human_design("crane"), points=2)
>>> print(f"{lever.rest.efficiency:.3f} free, {lever.rest.efficiency_against(0.1):.3f} loaded")
0.818 free, 0.456 loaded
"""

from bellcrank.machines.assembly import Machine, assemble, simulate
from bellcrank.machines.characterisation import Characterisation, characterise, default_loads
from bellcrank.machines.characterisation_files import (
    characterisation_from_dict,
    characterisation_to_dict,
    read_characterisation,
    write_characterisation,
)
from bellcrank.machines.curves import Load, PortCurve, trace
from bellcrank.machines.elementary import DIRECTIONS, elementary, strut
from bellcrank.machines.plan import Plan, read_plan
from bellcrank.machines.ports import INPUT, OUTPUT, Port, mean_ports, ports_of
from bellcrank.machines.prediction import assembled_ports, predict
from bellcrank.machines.two_port import TwoPort, two_port_at

__all__ = [
    "DIRECTIONS",
    "INPUT",
    "OUTPUT",
    "Characterisation",
    "Load",
    "Machine",
    "Plan",
    "Port",
    "PortCurve",
    "TwoPort",
    "assemble",
    "assembled_ports",
    "characterisation_from_dict",
    "characterisation_to_dict",
    "characterise",
    "default_loads",
    "elementary",
    "mean_ports",
    "ports_of",
    "predict",
    "read_characterisation",
    "read_plan",
    "simulate",
    "strut",
    "trace",
    "two_port_at",
    "write_characterisation",
]
