"""Search: which beams of a lattice to keep.

Searches, moves, costs and schedules are registries. A chain is a pure function from one state to
the next (`advance_chain`) with a generator around it (`chain_blocks`); `run_chains` stores many
chains in a run folder; `select` chooses one design from the results.

Modules: `registry` (searches), `settings`, `evaluator` (interface to the models), `blocks`,
`parallel`, `selection`, `cleaning`, `verification` (of finished frames); `markov` (Metropolis
chains, tempering), `hopping` (the default search), `constraints` (goals and load cases), `kernels`
(compiled loops).

Examples
--------
>>> from bellcrank.model import find_problem
>>> settings = HoppingSettings(steps=500)
>>> evaluator = make_evaluator(find_problem("scaling-8"), settings)
>>> *_, (state, proposals) = chain_blocks(evaluator, settings, chain=0)
>>> state.step, len(proposals.efficiency)
(500, 250)
"""

from bellcrank.search.blocks import BLOCK
from bellcrank.search.cleaning import clean, pieces
from bellcrank.search.default_specification import specified
from bellcrank.search.evaluator import (
    Evaluator,
    make_evaluator,
    symmetry_groups,
    verification_evaluator,
    with_stable_initial,
)
from bellcrank.search.hopping import HoppingSettings, HoppingState
from bellcrank.search.markov import (
    ChainState,
    Cost,
    MetropolisSettings,
    Move,
    TemperingSettings,
    TemperingState,
    costs,
    moves,
    schedules,
)
from bellcrank.search.parallel import Progress, run_chains
from bellcrank.search.registry import (
    DEFAULT_SEARCH,
    Search,
    State,
    advance_chain,
    chain_blocks,
    is_done,
    read_settings,
    read_state,
    searches,
    start_chain,
)
from bellcrank.search.relaxation import relaxed
from bellcrank.search.selection import (
    Candidate,
    Choice,
    Finalist,
    Refusals,
    Selection,
    candidates_of,
    confirmed,
    most_efficient,
    peaks,
    plateau_ends,
    plateaus,
    select,
)
from bellcrank.search.settings import SearchSettings
from bellcrank.search.specification import SpecificationEvaluator
from bellcrank.search.verdict import Verdict

__all__ = [
    "BLOCK",
    "DEFAULT_SEARCH",
    "Candidate",
    "ChainState",
    "Choice",
    "Cost",
    "Evaluator",
    "Finalist",
    "HoppingSettings",
    "HoppingState",
    "MetropolisSettings",
    "Move",
    "Progress",
    "Refusals",
    "Search",
    "SearchSettings",
    "Selection",
    "SpecificationEvaluator",
    "State",
    "TemperingSettings",
    "TemperingState",
    "Verdict",
    "advance_chain",
    "candidates_of",
    "chain_blocks",
    "clean",
    "confirmed",
    "costs",
    "is_done",
    "make_evaluator",
    "most_efficient",
    "moves",
    "peaks",
    "pieces",
    "plateau_ends",
    "plateaus",
    "read_settings",
    "read_state",
    "relaxed",
    "run_chains",
    "schedules",
    "searches",
    "select",
    "specified",
    "start_chain",
    "symmetry_groups",
    "verification_evaluator",
    "with_stable_initial",
]
