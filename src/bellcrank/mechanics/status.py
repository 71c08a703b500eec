"""Codes that say how the search for an equilibrium ended."""

from __future__ import annotations

from enum import IntEnum


class Outcome(IntEnum):
    """Base of enumerations whose integer codes are written to files.

    A member has the attributes ``label``, its name in lower case, and ``message``, a sentence
    that says what the code means.
    """

    message: str

    def __new__(cls, value: int, message: str = "") -> Outcome:  # noqa: PYI034
        """Create a member from its code and its message."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.message = message
        return member

    @property
    def label(self) -> str:
        """Name of the code as written to files."""
        return self.name.lower()

    @property
    def is_admissible(self) -> bool:
        """Whether a search may accept a design with this outcome."""
        return self.name == "CONVERGED"


class Status(Outcome):
    """How the search for the equilibrium of a design ended.

    Searches write further codes; `bellcrank.search.Verdict` has all of them.
    """

    CONVERGED = 0, "a stable equilibrium was reached from rest along a stable path"
    SNAPPED = (
        1,
        (
            "the structure loses its stability along the stroke, or nearly so; the response is "
            "that of one of several branches"
        ),
    )
    MECHANISM = 2, "a driven piece is not supported against rigid-body motion"
    UNCONVERGED = 3, "no stable equilibrium was found at full load"
    UNVERIFIED = (
        6,
        (
            "a stable equilibrium; a search did not need to verify that it is the one reached from "
            "rest, or could not without following the path"
        ),
    )
