"""Basin hopping, the default search: local search by predicted flips, and restarts."""

from bellcrank.search.hopping.basin_hopping import BasinHopping
from bellcrank.search.hopping.local_search import LocalSearch, start_local_search
from bellcrank.search.hopping.settings import HoppingSettings
from bellcrank.search.hopping.state import HoppingState

__all__ = [
    "BasinHopping",
    "HoppingSettings",
    "HoppingState",
    "LocalSearch",
    "start_local_search",
]
