"""Bundled problems, by name.

To add one, write a function without parameters that returns a `Problem`, register it with
``@builtin.register("name")`` in a module of this folder, and import the module below.
"""

from bellcrank.model.builtin import crane, discs, pliers, scaling, space
from bellcrank.model.builtin.registry import builtin
from bellcrank.model.builtin.space import IN_SPACE

__all__ = ["IN_SPACE", "builtin", "crane", "discs", "pliers", "scaling", "space"]
