"""Basin hopping, the default search: local search by predicted flips, and perturbations."""

from bellcrank.search.hopping.basin_hopping import HoppingSettings, HoppingState
from bellcrank.search.hopping.local_search import LocalSearch, start_local_search

__all__ = ["HoppingSettings", "HoppingState", "LocalSearch", "start_local_search"]
