"""Search: which beams to keep.

Searches, moves, costs and schedules are registries. A chain is a pure function from one
state to the next (`advance_chain`) and a generator around it (`chain_blocks`); `run_chains`
keeps many of them in a run folder; `select` makes of what they found one design to build.

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
from bellcrank.search.cleaning import clean, loaded_beams, pieces
from bellcrank.search.costs import Cost, costs
from bellcrank.search.evaluator import Evaluator, make_evaluator
from bellcrank.search.hopping import HoppingSettings, HoppingState
from bellcrank.search.metropolis import ChainState, InformedSettings, MetropolisSettings
from bellcrank.search.moves import Move, moves
from bellcrank.search.parallel import Progress, default_workers, run_chain, run_chains
from bellcrank.search.schedules import schedules
from bellcrank.search.searches import (
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
from bellcrank.search.tempering import TemperingSettings, TemperingState
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
    "InformedSettings",
    "MetropolisSettings",
    "Move",
    "Progress",
    "Refusals",
    "Search",
    "SearchSettings",
    "Selection",
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
    "default_workers",
    "is_done",
    "loaded_beams",
    "make_evaluator",
    "most_efficient",
    "moves",
    "peaks",
    "pieces",
    "plateau_ends",
    "plateaus",
    "read_settings",
    "read_state",
    "run_chain",
    "run_chains",
    "schedules",
    "searches",
    "select",
    "start_chain",
]
