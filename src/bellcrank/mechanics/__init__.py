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
    loaded_beams,
    output_stiffness,
    predict_output_stiffness,
    strain_of,
)
from bellcrank.mechanics.conditions import Conditions, LinearEquations
from bellcrank.mechanics.contact import BentStruts, near_pairs
from bellcrank.mechanics.coupling import Coupling, free_nodes, uniform_motion
from bellcrank.mechanics.evaluator import (
    VERIFICATION_INCREMENT,
    FlipPrediction,
    Response,
    SpringEvaluator,
    UnloadedBeams,
)
from bellcrank.mechanics.following import Movable, PathEnd, follow
from bellcrank.mechanics.frames.case import CaseEvaluator, Channel
from bellcrank.mechanics.frames.compilation import compile_ahead
from bellcrank.mechanics.frames.evaluator import FrameEvaluator
from bellcrank.mechanics.frames.quantities import quantities
from bellcrank.mechanics.frames.stroke import Quantities
from bellcrank.mechanics.items import (
    ItemResult,
    item_results,
    margin,
    objective_value,
    quantity_values,
    reduced,
    tightened,
    violation,
    worst_value,
)
from bellcrank.mechanics.memory import check_memory, evaluators_that_fit
from bellcrank.mechanics.models import (
    ModelEvaluator,
    load_bearing_core,
    model_evaluator,
    model_name,
)
from bellcrank.mechanics.objectives import (
    Objective,
    efficiency_of,
    objective_name,
    objective_of,
    objectives,
)
from bellcrank.mechanics.output import OutputMotion, output_motion
from bellcrank.mechanics.status import Outcome, Status
from bellcrank.mechanics.stroke import StrokeEvaluator, at_fraction, increment_at
from bellcrank.mechanics.stroke_record import StrokeRecord, channels_of, has_channels
from bellcrank.mechanics.superelement import Condensed, State, Superelement, state_of

__all__ = [
    "VERIFICATION_INCREMENT",
    "BentStruts",
    "CaseEvaluator",
    "Channel",
    "Condensed",
    "Conditions",
    "Core",
    "Coupling",
    "FlipPrediction",
    "FrameEvaluator",
    "ItemResult",
    "LinearEquations",
    "ModelEvaluator",
    "Movable",
    "Objective",
    "Outcome",
    "OutputMotion",
    "PathEnd",
    "Quantities",
    "Response",
    "SpringEvaluator",
    "State",
    "Status",
    "Strain",
    "StrokeEvaluator",
    "StrokeRecord",
    "Superelement",
    "UnloadedBeams",
    "at_fraction",
    "channels_of",
    "check_memory",
    "compile_ahead",
    "efficiency_of",
    "evaluators_that_fit",
    "follow",
    "free_nodes",
    "has_channels",
    "increment_at",
    "item_results",
    "load_bearing_core",
    "loaded_beams",
    "margin",
    "model_evaluator",
    "model_name",
    "near_pairs",
    "objective_name",
    "objective_of",
    "objective_value",
    "objectives",
    "output_motion",
    "output_stiffness",
    "predict_output_stiffness",
    "quantities",
    "quantity_values",
    "reduced",
    "state_of",
    "strain_of",
    "tightened",
    "uniform_motion",
    "violation",
    "worst_value",
]
