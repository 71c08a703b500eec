"""NGSolve, imported when it is first needed."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

THREADS = 2
LARGE = 200_000
"""Unknowns from which on threads are worth it: they wait busily for each other, and on a machine
that others use as well that can take ten times as long as the work."""


def ngsolve() -> Any:
    """Return the module NGSolve.

    Raises
    ------
    InvalidSettings
        If it is not installed.
    """
    try:
        import ngsolve as module
    except ImportError as missing:
        raise InvalidSettings(
            "levels plane and solid need NGSolve; install it with: pip install 'bellcrank[fem]'"
        ) from missing
    return module


@contextmanager
def threads(unknowns: int) -> Iterator[None]:
    """Let NGSolve work in some threads if there are many unknowns."""
    if unknowns < LARGE:
        yield
        return
    module = ngsolve()
    module.SetNumThreads(THREADS)
    with module.TaskManager():
        yield
