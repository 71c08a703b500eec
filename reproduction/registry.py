"""Studies: parts of the paper and comparisons, each computed by one command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from reproduction.result_store import ResultStore

Figures = dict[str, Any]
"""Plain figures of a study, ready for JSON."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A row of the comparison with the paper.

    Parameters
    ----------
    what
        The compared quantity.
    paper
        Value of the paper, or the reference of a study that is not part of it; empty if there is
        none.
    ours
        Value of this package.
    note
        Remarks, for example on differences.
    """

    what: str
    paper: str
    ours: str
    note: str = ""

    def to_dict(self) -> dict[str, str]:
        """Return it as plain data."""
        return {"what": self.what, "paper": self.paper, "ours": self.ours, "note": self.note}


@dataclass(frozen=True, slots=True)
class Study:
    """The reproduction of one figure or table of the paper, or a comparison beside it.

    Parameters
    ----------
    name
        Name on the command line.
    title
        Title on one line.
    after
        Part of the paper that is reproduced.
    full, quick
        Settings as dataclasses of plain data: for a day of computation, and for a quick check.
    run
        Function of settings and a store that returns plain figures.
    draw
        Function of the figures and a path that draws a picture.
    claims
        Function of the figures that returns the rows of the comparison.
    runs
        Function of the figures that returns the computed amount as text.
    deviations
        Differences from the procedure of the paper, as sentences.
    page
        Page of the documentation that shows the record, without suffix: ``"paper"`` for parts of
        the paper and comparisons with it.
    """

    name: str
    title: str
    after: str
    full: Any
    quick: Any
    run: Callable[[Any, ResultStore], Figures]
    draw: Callable[[Mapping[str, Any], Path], None]
    claims: Callable[[Mapping[str, Any]], list[Claim]]
    runs: Callable[[Mapping[str, Any]], str]
    deviations: tuple[str, ...] = ()
    page: str = "paper"


studies: Registry[Study] = Registry("study")
"""All studies, in the order of the paper."""


def register(study: Study) -> Study:
    """Register a study under its name."""
    studies.register(study.name)(study)
    return study
