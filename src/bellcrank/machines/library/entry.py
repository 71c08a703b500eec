"""An entry of the library: a design, and all that a person or a machine must know to use it."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.elementary import DIRECTIONS
from bellcrank.machines.library.kinds import OWN

if TYPE_CHECKING:
    from bellcrank.machines.characterise import Characterisation
    from bellcrank.model import Design, Output

DIGITS = 8
"""Of the hash that a name ends with."""
MIXED = "mixed"
"""Direction of an output whose nodes are to go different ways, like jaws."""


@dataclass(frozen=True, slots=True)
class FrameCheck:
    """What finite elements say of the part: frames, large and small motions.

    Parameters
    ----------
    status
        ``converged`` if the part is stable all along the stroke.
    reached
        Part of the stroke up to which it is.
    efficiency, linear_efficiency
        At the full stroke, and for small motions; nan where there is none.
    stress, strain
        Largest von Mises stress, MPa, and principal strain at the last stable state.
    force
        On the input there, N.
    theory, material
        Of the struts.
    width, thickness, scale
        Of the struts, and length of a lattice unit, mm.
    warnings
        What a builder should know, in sentences.
    """

    status: str
    reached: float
    efficiency: float
    linear_efficiency: float
    stress: float
    strain: float
    force: float
    theory: str
    material: str
    width: float
    thickness: float
    scale: float
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class LeverCheck:
    """The plain lever for the same task: under the same load, keeping the same goals.

    Parameters
    ----------
    efficiency
        At the full stroke; nan where no lever is stable and keeps the goals.
    unbound_efficiency
        Of the best lever whatever goals it breaks.
    shape
        In words.
    mask
        Its beams; empty where there is none.
    """

    efficiency: float
    unbound_efficiency: float
    shape: str = ""
    mask: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """An actuator of the library.

    Parameters
    ----------
    design
        With its efficiency under the load that it was made for.
    direction
        Of the output: a name in `DIRECTIONS`, or ``"mixed"``.
    columns
        Of the task, which say how large it is; None for a design of another lattice.
    kind
        What it was made for: a name in `kinds`, or ``"own"``.
    characterisation
        As a two-port, its springs left out.
    validation
        By finite elements.
    lever
        What it is compared with.
    provenance
        How it came about.
    """

    design: Design
    direction: str
    columns: int | None
    kind: str
    characterisation: Characterisation
    validation: FrameCheck
    lever: LeverCheck
    provenance: dict[str, Any] = field(default_factory=dict)

    @property
    def hash(self) -> str:
        """What tells it from others: the same problem, beams and kind have the same."""
        return identity(self.design, self.kind)

    @property
    def name(self) -> str:
        """``DIRECTION-COLUMNS-KIND-HASH``, without what it has not got."""
        return name_of(self.design, self.direction, self.columns, self.kind)

    @property
    def efficiency(self) -> float:
        """At the full stroke, under the load that it was made for."""
        return math.nan if self.design.efficiency is None else self.design.efficiency

    @property
    def clear(self) -> bool:
        """Whether there is nothing to be warned of: struts that touch, a loss of stability."""
        return not (self.validation.warnings or self.characterisation.doubts)

    @property
    def better(self) -> bool:
        """Whether it is more efficient than the plain lever."""
        return not self.lever.efficiency >= self.efficiency


def identity(design: Design, kind: str) -> str:
    """Return the hash that names a design of a kind.

    Examples
    --------
    >>> from bellcrank.machines import elementary
    >>> identity(elementary(9, "down").full_design(), "free")
    '15be2a2a'
    """
    told = {"kind": kind, "mask": design.mask_hex, "problem": design.problem.hash}
    return hashlib.sha256(canonical(told).encode()).hexdigest()[:DIGITS]


def name_of(
    design: Design, direction: str | None = None, columns: int | None = None, kind: str = OWN
) -> str:
    """Return the name of the entry that a design is or would be; by default somebody's own.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> name_of(human_design("crane"))
    'left-own-48476f52'
    """
    whither = direction or direction_of(design.problem.output)
    return f"{stem(whither, columns, kind)}-{identity(design, kind)}"


def canonical(data: Any) -> str:
    """Return the one text of plain data that hashes are taken from."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"))


def stem(direction: str, columns: int | None, kind: str) -> str:
    """Return the name of a task, with which those of its entries begin.

    Examples
    --------
    >>> stem("down", 9, "free"), stem("up-left", None, "own")
    ('down-9-free', 'up-left-own')
    """
    return "-".join(str(part) for part in (direction, columns, kind) if part is not None)


def check_kind(kind: str) -> str:
    """Return a kind that an entry may have.

    Raises
    ------
    UnknownName
    """
    from bellcrank.machines.library.kinds import kinds

    if kind != OWN:
        kinds[kind]
    return kind


def check_direction(direction: str) -> str:
    """Return a direction that an entry may have.

    Raises
    ------
    InvalidSettings

    Examples
    --------
    >>> check_direction("upwards")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidSettings: direction: expected one of right, ..., got 'upwards'
    """
    if direction not in DIRECTIONS and direction != MIXED:
        raise InvalidSettings(
            f"direction: expected one of {', '.join(DIRECTIONS)}, got {direction!r}"
        )
    return direction


def direction_of(output: Output) -> str:
    """Return the name of the direction nearest to where an output is to go, on average.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> direction_of(find_problem("crane").output), direction_of(find_problem("pliers").output)
    ('left', 'down')
    """
    mean = output.direction.mean(axis=0)
    if np.hypot(*mean) < 0.5:
        return MIXED
    angle = math.degrees(math.atan2(mean[1], mean[0]))
    return min(DIRECTIONS, key=lambda name: abs((DIRECTIONS[name] - angle + 180) % 360 - 180))
