"""Goals: what a design must keep beside being efficient, in one, several or all of its loads.

A goal is a short text (``"mass <= 0.6"``, ``"no-contact 0.1"``), an entry of the registry
`terms`. `GoalEvaluator` answers a search that has some; `Case` and `at_strokes` say under which
loads a design is judged; `ParetoArchive` keeps the designs that no other beats in all respects.

Examples
--------
>>> sorted(terms)  # doctest: +NORMALIZE_WHITESPACE
['connected', 'degree', 'input-stiffness', 'mass', 'mirror', 'no-contact', 'no-snapping',
 'stiffness', 'strain']
"""

from bellcrank.search.goals import shape, mirror, response, contact  # noqa: I001 - as listed
from bellcrank.search.goals.cases import Case, at_strokes
from bellcrank.search.goals.contact import near_pairs, segment_distances
from bellcrank.search.goals.mirror import mirror_images
from bellcrank.search.goals.pareto import MEASURES, ParetoArchive
from bellcrank.search.goals.evaluator import GoalEvaluator, penalty_of
from bellcrank.search.goals.response import largest_strain
from bellcrank.search.goals.shape import mass_of
from bellcrank.search.goals.terms import Goal, Kind, Moved, Term, read_goal, terms

__all__ = [
    "MEASURES",
    "Case",
    "Goal",
    "GoalEvaluator",
    "Kind",
    "Moved",
    "ParetoArchive",
    "Term",
    "at_strokes",
    "contact",
    "largest_strain",
    "mass_of",
    "mirror",
    "mirror_images",
    "near_pairs",
    "penalty_of",
    "read_goal",
    "response",
    "segment_distances",
    "shape",
    "terms",
]
