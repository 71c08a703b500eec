"""Registry of the lattice generators."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.model.lattice import Lattice

lattices: Registry[Callable[..., Lattice]] = Registry("lattice")
