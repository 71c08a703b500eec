"""What entries to make: tasks, and how long to search for each."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.elementary import DIRECTIONS, elementary
from bellcrank.machines.library.entry import stem
from bellcrank.machines.library.kinds import Kind, kinds
from bellcrank.machines.library.lever import plain_lever
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.search import HoppingSettings

if TYPE_CHECKING:
    from bellcrank.model import Problem
    from bellcrank.search import SearchSettings


@dataclass(frozen=True, slots=True)
class Task:
    """One entry to make.

    Examples
    --------
    >>> Task("up", 9, "loaded").problem().name
    'elementary-9-up-loaded'
    """

    direction: str
    columns: int
    kind: str

    @property
    def name(self) -> str:
        """With which the name of the entry begins."""
        return stem(self.direction, self.columns, self.kind)

    def problem(self) -> Problem:
        """Return what the search is given: it may leave supports unused, as levers do."""
        given = elementary(self.columns, self.direction, kinds[self.kind].spring)
        lattice = given.lattice
        held = np.isin(lattice.beams, given.supports.nodes).all(axis=1)
        at_ports = lattice.beams_touching(np.concatenate([given.input.nodes, given.output.nodes]))
        return replace(given, designable=np.flatnonzero(~held & ~at_ports))

    def starts(self, chains: int) -> dict[str, tuple[Problem, int]]:
        """Return what searches begin with, and how many chains: the full lattice, and a lever.

        Half of the chains are given the plain lever, if there is one. What it is good at is far
        from the full lattice.
        """
        problem = self.problem()
        for goals in (kinds[self.kind].goals, ()):
            with contextlib.suppress(InvalidSettings):
                lever = plain_lever(problem, goals)
                break
        else:
            return {"full": (problem, chains)}
        initial = problem.initial.copy()
        initial[problem.designable] = lever.mask[problem.designable]
        begun = {
            "full": (problem, chains - chains // 2),
            "lever": (replace(problem, initial=initial), chains // 2),
        }
        if SpringEvaluator(problem).evaluate(initial).status is not Status.CONVERGED:
            # The whole port makes it snap, or so nearly that no search would begin there.
            return {"full": (problem, chains)}
        return {name: start for name, start in begun.items() if start[1]}


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """What entries to make, and how long to search for each.

    Parameters
    ----------
    directions, columns, kinds
        An entry for each combination.
    steps, chains, seed
        Of each search.

    Raises
    ------
    InvalidSettings, UnknownName

    Examples
    --------
    >>> len(Order().tasks)
    72
    """

    directions: tuple[str, ...] = tuple(DIRECTIONS)
    columns: tuple[int, ...] = (9, 7, 12)
    kinds: tuple[str, ...] = tuple(kinds)
    steps: int = 20_000
    chains: int = 4
    seed: int = 0

    def __post_init__(self) -> None:
        for task in self.tasks:
            task.problem()
            self.settings(kinds[task.kind])

    @property
    def tasks(self) -> list[Task]:
        """Of one size after the other."""
        return [
            Task(direction, columns, kind)
            for columns in self.columns
            for direction in self.directions
            for kind in self.kinds
        ]

    def settings(self, kind: Kind) -> SearchSettings:
        """Return what the search for a kind is told."""
        return HoppingSettings(
            steps=self.steps, chains=self.chains, seed=self.seed, goals=kind.goals
        )
