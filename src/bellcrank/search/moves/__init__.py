"""Moves of Markov chains over designs; each is a file, each in the registry."""

from bellcrank.search.moves import balanced, delayed, flip, node, swap
from bellcrank.search.moves.registry import Move, moves

__all__ = ["Move", "balanced", "delayed", "flip", "moves", "node", "swap"]
