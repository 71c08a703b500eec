"""Tolerance: what a part does when it is not printed or driven as it was drawn, or loses a strut.

`scenarios_of` lists deviations of widths, nodes and input, and losses of single struts;
`evaluate_scenarios` computes the specification in each of them, and `Tolerance` sums up.
"""

from bellcrank.tolerance.evaluation import ScenarioEvaluator, ScenarioResult, evaluate_scenarios
from bellcrank.tolerance.scenarios import Deviations, Scenario, scenarios_of
from bellcrank.tolerance.summary import Row, Tolerance

__all__ = [
    "Deviations",
    "Row",
    "Scenario",
    "ScenarioEvaluator",
    "ScenarioResult",
    "Tolerance",
    "evaluate_scenarios",
    "scenarios_of",
]
