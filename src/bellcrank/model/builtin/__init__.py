"""The problems that come with bellcrank, by name.

A new one is a function without parameters that returns a Problem, in a file of
its own, under ``@builtin.register("name")``, and imported below.
"""

from bellcrank.model.builtin import crane, discs, pliers, scaling
from bellcrank.model.builtin.registry import builtin

__all__ = ["builtin", "crane", "discs", "pliers", "scaling"]
