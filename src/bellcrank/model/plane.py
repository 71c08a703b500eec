"""The check that a problem is in the plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.errors import InvalidProblem

if TYPE_CHECKING:
    from bellcrank.model.problem import Problem


def require_plane(problem: Problem, what: str) -> None:
    """Check that a problem is in the plane, at the entrance of work that is only defined there.

    Parameters
    ----------
    problem
        The problem.
    what
        The work, for the error.

    Raises
    ------
    InvalidProblem
        If the positions have three coordinates.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> require_plane(find_problem("crane"), "outline")
    """
    if problem.lattice.dimension != 2:
        raise InvalidProblem(
            f"{what}: problem {problem.name!r} is in space; only problems in the plane are "
            "accepted here"
        )
