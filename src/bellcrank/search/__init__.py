"""Search: which beams to keep.

Costs and schedules are registries; a chain is a pure function from one state to the
next (`advance_chain`) and a generator around it (`chain_blocks`); `run_chains` keeps
many of them in a run folder; `select` makes of what they found one design to build.
"""

from bellcrank.search.chain import (
    BLOCK,
    ChainState,
    Responder,
    advance_chain,
    advance_in_python,
    chain_blocks,
    is_done,
    start_chain,
)
from bellcrank.search.cleaning import clean, loaded_beams
from bellcrank.search.costs import Cost, costs
from bellcrank.search.parallel import Progress, default_workers, run_chain, run_chains
from bellcrank.search.schedules import schedules
from bellcrank.search.selection import (
    Candidate,
    Selection,
    candidates_of,
    pieces,
    plateaus,
    select,
)
from bellcrank.search.settings import MetropolisSettings, searches

__all__ = [
    "BLOCK",
    "Candidate",
    "ChainState",
    "Cost",
    "MetropolisSettings",
    "Progress",
    "Responder",
    "Selection",
    "advance_chain",
    "advance_in_python",
    "candidates_of",
    "chain_blocks",
    "clean",
    "costs",
    "default_workers",
    "is_done",
    "loaded_beams",
    "pieces",
    "plateaus",
    "run_chain",
    "run_chains",
    "schedules",
    "searches",
    "select",
    "start_chain",
]
