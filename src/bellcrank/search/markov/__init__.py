"""Markov chains over designs: the paper's Metropolis chain and parallel tempering."""

from bellcrank.search.markov.costs import Cost, costs, schedules
from bellcrank.search.markov.metropolis import ChainState, MetropolisSettings, metropolis_phase
from bellcrank.search.markov.moves import Move, moves
from bellcrank.search.markov.tempering import TemperingSettings, TemperingState

__all__ = [
    "ChainState",
    "Cost",
    "MetropolisSettings",
    "Move",
    "TemperingSettings",
    "TemperingState",
    "costs",
    "metropolis_phase",
    "moves",
    "schedules",
]
