"""What a study is: a part of the paper, remade by one command."""

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
        Is claimed, in our words.
    paper
        The paper's figure; empty if it gives none.
    ours
        Ours.
    note
        In what the two differ.
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
    """One figure or table of the paper, remade.

    Parameters
    ----------
    name
        On the command line.
    title
        In a line.
    after
        Which part of the paper it remakes.
    full, quick
        Settings, dataclasses of plain data: as far as a day allows, and for a look.
    run
        From settings and a store to plain figures.
    draw
        From the figures to a picture.
    claims
        From the figures to rows of the comparison; nothing else may claim anything.
    runs
        From the figures to how much was computed, in words.
    deviations
        In what this differs from what the paper did, as sentences.
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


studies: Registry[Study] = Registry("study")
"""All studies, in the order of the paper."""


def register(study: Study) -> Study:
    """File a study under its name."""
    studies.register(study.name)(study)
    return study
