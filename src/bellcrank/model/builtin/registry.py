"""Registry of the bundled problems."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.model.problem import Problem

builtin: Registry[Callable[[], Problem]] = Registry("problem")
