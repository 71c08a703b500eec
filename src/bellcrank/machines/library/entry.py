"""Entries of the library, and the kinds of actuators.

All actuators that `bellcrank library make` makes are straight motions with a payload
(`bellcrank.machines.library.tasks.straight_motion`); their kind is the payload.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.elementary import DIRECTIONS
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from bellcrank.machines.characterisation import Characterisation
    from bellcrank.model import Design, Output

HASH_DIGITS = 8
"""Number of hexadecimal digits of the hash at the end of a name."""
MIXED = "mixed"
"""Direction of an output whose nodes move in different directions, like jaws."""
OWN = "own"
"""Kind of an entry that was added by the user."""


FIGURES = (
    "efficiency", "efficiency_half", "travel_mm", "off_axis", "rotation_deg",
    "largest_input_force_N", "output_stiffness_N_per_mm", "payload_N", "blocked_force_N", "sag_mm",
)  # fmt: skip
"""Figures of a part (`bellcrank.workflows.part_figures`) that an entry has."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of elementary actuator.

    Parameters
    ----------
    title
        Name as it is shown; the registered name is the short form in names of entries.
    payload
        Force in N at the output that leaves at least half of the travel.

    Examples
    --------
    >>> kinds["straight-10g"]
    Kind(title='straight, 10 g', payload=0.1)
    """

    title: str
    payload: float


kinds: Registry[Kind] = Registry("kind of actuator")
for _grams in (10, 50, 100, 200):
    kinds.register(f"straight-{_grams}g")(Kind(f"straight, {_grams} g", _grams / 100))


def kind_title(kind: str) -> str:
    """Return the name of a kind as it is shown.

    Examples
    --------
    >>> kind_title("straight-50g"), kind_title("own")
    ('straight, 50 g', 'own design')
    """
    return kinds[kind].title if kind in kinds else f"{kind} design"


@dataclass(frozen=True, slots=True)
class FrameResult:
    """Results of the frame analyses of the part, linear and geometrically nonlinear.

    Parameters
    ----------
    status
        ``converged`` if the part is stable along the whole stroke.
    reached
        Stable fraction of the stroke.
    efficiency, linear_efficiency
        Efficiency at the full stroke, and for small strokes; nan if there is none.
    stress, strain
        Largest von Mises stress in MPa, and largest principal strain, at the last stable state.
    force
        Input force at the last stable state, N.
    theory, material
        Beam theory and material.
    width, thickness, scale
        Width and thickness of the struts, and length of a lattice unit, mm.
    warnings
        Limits of the results, one sentence each.
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


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """An actuator of the library.

    Parameters
    ----------
    design
        Design, with its efficiency.
    direction
        Output direction: a name in `DIRECTIONS`, or ``"mixed"``.
    columns
        Size of its elementary problem; None for a design of another lattice.
    kind
        A name in `kinds`, or ``"own"`` for a design of the user.
    characterisation
        Two-port, without the springs of the problem.
    validation
        Results of the frame analyses.
    provenance
        Origin of the design and of the results.
    figures
        Figures of the part with 8 elements in each strut (`FIGURES`); empty for springs.
    """

    design: Design
    direction: str
    columns: int | None
    kind: str
    characterisation: Characterisation
    validation: FrameResult
    provenance: dict[str, Any] = field(default_factory=dict)
    figures: dict[str, float | None] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """``DIRECTION-COLUMNS-KIND-HASH``, without columns if there are none."""
        return name_of(self.design, self.direction, self.columns, self.kind)

    @property
    def efficiency(self) -> float:
        """Efficiency at the full stroke."""
        return math.nan if self.design.efficiency is None else self.design.efficiency

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the frame analyses and of the two-port."""
        return (*self.validation.warnings, *self.characterisation.warnings)


def identity(design: Design, kind: str) -> str:
    """Return the hash of problem, beams and kind at the end of a name.

    Examples
    --------
    >>> from bellcrank.machines import elementary
    >>> identity(elementary(9, "down").full_design(), "own")
    '2bfcbcd9'
    """
    content = {"kind": kind, "mask": design.mask_hex, "problem": design.problem.hash}
    return hashlib.sha256(canonical(content).encode()).hexdigest()[:HASH_DIGITS]


def name_of(
    design: Design, direction: str | None = None, columns: int | None = None, kind: str = OWN
) -> str:
    """Return the name of the entry of a design.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> name_of(human_design("crane"))
    'left-own-48476f52'
    """
    towards = direction or direction_of(design.problem.output)
    return f"{stem(towards, columns, kind)}-{identity(design, kind)}"


def canonical(data: Any) -> str:
    """Return the canonical JSON text of plain data, for hashes."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"))


def stem(direction: str, columns: int | None, kind: str) -> str:
    """Return the name of an entry without its hash.

    Examples
    --------
    >>> stem("down", 9, "straight-10g"), stem("up-left", None, "own")
    ('down-9-straight-10g', 'up-left-own')
    """
    return "-".join(str(part) for part in (direction, columns, kind) if part is not None)


def check_kind(kind: str) -> None:
    """Check the kind of an entry.

    Raises
    ------
    UnknownName
    """
    if kind != OWN:
        kinds[kind]


def check_direction(direction: str) -> None:
    """Check the direction of an entry.

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


def direction_of(output: Output) -> str:
    """Return the name of the direction nearest to the mean direction of an output.

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
