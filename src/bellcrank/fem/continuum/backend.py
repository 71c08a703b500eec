"""NGSolve, imported on first use."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

THREADS = 2
MANY_UNKNOWNS = 200_000
"""Number of unknowns above which threads are used. Threads of NGSolve wait actively for each other,
so that on a busy machine they can take ten times as long as the computation."""


def ngsolve() -> Any:
    """Return the module NGSolve.

    Raises
    ------
    InvalidSettings
        If it is not installed.
    """
    try:
        import ngsolve as module
    except ImportError as error:
        raise InvalidSettings(
            "levels plane and solid need NGSolve; install it with: pip install 'bellcrank[fem]'"
        ) from error
    return module


def missing_ngsolve() -> str | None:
    """Return how to install NGSolve, or None if it is installed."""
    try:
        ngsolve()
    except InvalidSettings as error:
        return str(error)
    return None


@contextmanager
def threads(unknowns: int) -> Iterator[None]:
    """Use several threads of NGSolve if there are many unknowns."""
    if unknowns < MANY_UNKNOWNS:
        yield
        return
    module = ngsolve()
    module.SetNumThreads(THREADS)
    with module.TaskManager():
        yield
