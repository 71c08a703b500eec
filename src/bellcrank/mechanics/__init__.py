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
from bellcrank.mechanics.conditions import Conditions, Linear
from bellcrank.mechanics.evaluator import (
    VERIFICATION_INCREMENT,
    FlipPrediction,
    Response,
    SpringEvaluator,
    UnloadedBeams,
)
from bellcrank.mechanics.following import Arrival, follow
from bellcrank.mechanics.grips import Grip, Loose, Rigid, Sliding
from bellcrank.mechanics.memory import check_memory, evaluators_that_fit
from bellcrank.mechanics.objectives import (
    Objective,
    efficiency_of,
    objective_name,
    objective_of,
    objectives,
)
from bellcrank.mechanics.status import Outcome, Status
from bellcrank.mechanics.stroke import StrokeEvaluator, at_fraction
from bellcrank.mechanics.substructure import Condensed, Substructure
from bellcrank.mechanics.superelement import State, Superelement

__all__ = [
    "VERIFICATION_INCREMENT",
    "Arrival",
    "Condensed",
    "Conditions",
    "Core",
    "FlipPrediction",
    "Grip",
    "Linear",
    "Loose",
    "Objective",
    "Outcome",
    "Response",
    "Rigid",
    "Sliding",
    "SpringEvaluator",
    "State",
    "Status",
    "Strain",
    "StrokeEvaluator",
    "Substructure",
    "Superelement",
    "UnloadedBeams",
    "at_fraction",
    "check_memory",
    "efficiency_of",
    "evaluators_that_fit",
    "follow",
    "load_bearing_core",
    "loaded_beams",
    "objective_name",
    "objective_of",
    "objectives",
    "output_stiffness",
    "predict_output_stiffness",
    "strain_of",
]
