"""Energy, equilibrium, efficiency and sensitivity of a design.

The work flow, in four lines:

>>> from bellcrank.mechanics import Evaluator
>>> from bellcrank.model import find_problem
>>> evaluator = Evaluator(find_problem("anti-parallel"))
>>> round(evaluator.respond(evaluator.problem.initial).efficiency, 7)
0.0420422
"""

from bellcrank.mechanics.carrying import Core, foresee_stiffness, output_stiffness
from bellcrank.mechanics.evaluator import (
    CAREFUL,
    Dangling,
    Evaluator,
    Response,
    Screening,
    Status,
    load_bearing_core,
)
from bellcrank.mechanics.minimisers import Minimiser, minimisers
from bellcrank.mechanics.objectives import Objective, efficiency_of, objective_of, objectives

__all__ = [
    "CAREFUL",
    "Core",
    "Dangling",
    "Evaluator",
    "Minimiser",
    "Objective",
    "Response",
    "Screening",
    "Status",
    "efficiency_of",
    "foresee_stiffness",
    "load_bearing_core",
    "minimisers",
    "objective_of",
    "objectives",
    "output_stiffness",
]
