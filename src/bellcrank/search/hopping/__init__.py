"""Basin hopping, the default search: local search by predicted flips, and perturbations."""

from bellcrank.search.hopping.basin_hopping import HoppingState
from bellcrank.search.hopping.local_search import LocalSearch, start_local_search
from bellcrank.search.hopping.settings import HoppingSettings

__all__ = ["HoppingSettings", "HoppingState", "LocalSearch", "start_local_search"]
