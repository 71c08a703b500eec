"""Energy, equilibrium, efficiency and sensitivity of a design.

Examples
--------
>>> from bellcrank.mechanics import SpringEvaluator
>>> from bellcrank.model import find_problem
>>> evaluator = SpringEvaluator(find_problem("anti-parallel"))
>>> round(evaluator.evaluate(evaluator.problem.initial).efficiency, 7)
0.0420422
"""

from bellcrank.mechanics.analysis import (
    Core,
    Strain,
    load_bearing_core,
    loaded_beams,
    output_stiffness,
    predict_output_stiffness,
    strain_of,
)
from bellcrank.mechanics.conditions import Conditions, LinearEquations
from bellcrank.mechanics.evaluator import (
    VERIFICATION_INCREMENT,
    FlipPrediction,
    Response,
    SpringEvaluator,
    UnloadedBeams,
)
from bellcrank.mechanics.following import PathEnd, follow
from bellcrank.mechanics.memory import check_memory, evaluators_that_fit
from bellcrank.mechanics.objectives import (
    Objective,
    efficiency_of,
    objective_name,
    objective_of,
    objectives,
)
from bellcrank.mechanics.status import Outcome, Status
from bellcrank.mechanics.stroke import StrokeEvaluator, at_fraction, increment_at
from bellcrank.mechanics.superelement import (
    Condensed,
    Coupling,
    State,
    Superelement,
    free_nodes,
    uniform_motion,
)

__all__ = [
    "VERIFICATION_INCREMENT",
    "Condensed",
    "Conditions",
    "Core",
    "Coupling",
    "FlipPrediction",
    "LinearEquations",
    "Objective",
    "Outcome",
    "PathEnd",
    "Response",
    "SpringEvaluator",
    "State",
    "Status",
    "Strain",
    "StrokeEvaluator",
    "Superelement",
    "UnloadedBeams",
    "at_fraction",
    "check_memory",
    "efficiency_of",
    "evaluators_that_fit",
    "follow",
    "free_nodes",
    "increment_at",
    "load_bearing_core",
    "loaded_beams",
    "objective_name",
    "objective_of",
    "objectives",
    "output_stiffness",
    "predict_output_stiffness",
    "strain_of",
    "uniform_motion",
]
