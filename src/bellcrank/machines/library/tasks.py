"""Searches for entries: one problem for each direction, size and kind."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.machines.elementary import DIRECTIONS, elementary
from bellcrank.machines.library.entry import kinds, stem
from bellcrank.model import Item, ObjectiveTerm, Specification
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search import HoppingSettings
from bellcrank.task.units import units_of

if TYPE_CHECKING:
    from bellcrank.model import Problem
    from bellcrank.search import SearchSettings


OFF_AXIS, ROTATION, SAG = 0.05, 3.0, 0.1
"""Largest off-axis motion and sag of a straight motion, as parts of the travel, and its largest
rotation in degrees."""


def straight_motion(problem: Problem, payload: float, spec: PartSpec | None = None) -> Problem:
    """Return the frame of a part with the specification of a straight motion.

    The gain is maximised and at least 1, and no struts touch.

    Parameters
    ----------
    problem
        Frame of the part.
    payload
        Smallest force in N that halves the travel.
    spec
        The part; the default one if it is not given.

    Examples
    --------
    >>> wanted = EntryTask("left", 7, "straight-10g").problem().specification
    >>> [item.name for item in wanted.items][:3]
    ['case.output.gain', 'case.output.off_axis', 'case.output.rotation']
    """
    spec = spec or PartSpec()
    case, output = "case", "output"
    units = units_of(problem, spec)
    carried = units.in_problem("force", payload)
    off_axis = Item(quantity="off_axis", case=case, output=output, at_most=OFF_AXIS)
    rotation = Item(
        quantity="rotation", case=case, output=output, start=0.0, at_least=-ROTATION,
        at_most=ROTATION,
    )  # fmt: skip
    items = (
        Item(quantity="gain", case=case, output=output, at_least=1.0),
        off_axis,
        rotation,
        Item(quantity="sag", case=case, output=output, at_most=SAG),
        Item(quantity="payload", case=case, output=output, at_least=carried),
        Item(
            quantity="strain",
            case=case,
            start=0.0,
            at_most=spec.registered_material.strain_limit,
        ),
        Item(quantity="clearance", case=case, at_least=0.0),
    )
    weight = units.weight * np.array([0.0, -1.0])
    gain = ObjectiveTerm(quantity="gain", case=case, output=output)
    wanted = Specification(items=items, maximise=(gain,), weight=weight)
    return replace(problem, specification=wanted)


@dataclass(frozen=True, slots=True)
class EntryTask:
    """The task of making one entry.

    Parameters
    ----------
    direction, columns, kind
        Properties of the entry.

    Examples
    --------
    >>> EntryTask("up", 9, "straight-10g").problem().name
    'elementary-9-up'
    """

    direction: str
    columns: int
    kind: str

    @property
    def name(self) -> str:
        """Name of the entry without its hash."""
        return stem(self.direction, self.columns, self.kind)

    def problem(self) -> Problem:
        """Return the problem of the search; beams at unused supports may be removed.

        Its beams are struts of the default part, 2 mm wide on 10 mm.
        """
        given = frame_problem(elementary(self.columns, self.direction), PartSpec())
        given = straight_motion(given, kinds[self.kind].payload)
        lattice = given.lattice
        held = np.isin(lattice.beams, given.supports.nodes).all(axis=1)
        at_ports = lattice.beams_touching(np.concatenate([given.input.nodes, given.output.nodes]))
        return replace(given, designable=np.flatnonzero(~held & ~at_ports))


@dataclass(frozen=True, slots=True, kw_only=True)
class MakeSettings:
    """Entries to make, and the length of each search.

    Parameters
    ----------
    directions, columns, kinds
        One entry is made for each combination.
    steps, chains, seed
        Settings of each search.

    Raises
    ------
    InvalidSettings, UnknownName

    Examples
    --------
    >>> len(MakeSettings().tasks)
    96
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
        self.search_settings()

    @property
    def tasks(self) -> list[EntryTask]:
        """The tasks, one size after the other."""
        return [
            EntryTask(direction, columns, kind)
            for columns in self.columns
            for direction in self.directions
            for kind in self.kinds
        ]

    def search_settings(self) -> SearchSettings:
        """Return the settings of each search."""
        return HoppingSettings(steps=self.steps, chains=self.chains, seed=self.seed)
