"""Constraints of a search, and load cases.

A constraint is written as a short text, a goal (``"mass <= 0.6"``, ``"no-contact 0.1"``), and is
an entry of the registry `constraints`. `ConstrainedEvaluator` evaluates designs under constraints
and in several load cases (`LoadCase`, `at_strokes`).

Examples
--------
>>> sorted(constraints)  # doctest: +NORMALIZE_WHITESPACE
['connected', 'degree', 'input-stiffness', 'mass', 'mirror', 'no-contact', 'no-snapping',
 'stiffness', 'strain']
"""

from bellcrank.search.constraints.cases import LoadCase, at_strokes
from bellcrank.search.constraints.constraint import (
    Constraint,
    ConstraintType,
    DeformedDesign,
    Goal,
    constraints,
    mirror_axes,
    parse_goal,
)
from bellcrank.search.constraints.evaluator import ConstrainedEvaluator, penalty_of
from bellcrank.search.constraints.response import no_contact  # registers
from bellcrank.search.constraints.structure import mass_of

__all__ = [
    "ConstrainedEvaluator",
    "Constraint",
    "ConstraintType",
    "DeformedDesign",
    "Goal",
    "LoadCase",
    "at_strokes",
    "constraints",
    "mass_of",
    "mirror_axes",
    "no_contact",
    "parse_goal",
    "penalty_of",
]
