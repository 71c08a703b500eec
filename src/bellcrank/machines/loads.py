"""What an actuator may work against."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, cast, get_args

from bellcrank.errors import InvalidSettings

LoadKind = Literal["free", "blocked", "spring", "force"]


@dataclass(frozen=True, slots=True)
class Load:
    """What stands against the mean motion of an output.

    Parameters
    ----------
    kind
        ``"free"``: nothing; ``"blocked"``: it is held where it is at rest; ``"spring"``;
        ``"force"``: a dead force, put on before the stroke.
    value
        Stiffness of the spring, or the force along the wanted direction, below 0 where it
        resists; in lattice units.

    Raises
    ------
    InvalidSettings
        If the kind is unknown, or the value makes no sense for it.
    """

    kind: LoadKind = "free"
    value: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(LoadKind):
            raise InvalidSettings(
                f"load: expected one of {', '.join(get_args(LoadKind))}, got {self.kind!r}"
            )
        if not math.isfinite(self.value) or (self.kind == "spring" and self.value < 0.0):
            raise InvalidSettings(
                f"load {self.kind}: expected a number, for a spring at least 0, got {self.value!r}"
            )
        if self.kind in ("free", "blocked") and self.value != 0.0:
            raise InvalidSettings(f"load {self.kind}: takes no value, got {self.value!r}")

    @property
    def label(self) -> str:
        """As it is typed."""
        return self.kind if self.kind in ("free", "blocked") else f"{self.kind}:{self.value!r}"

    @classmethod
    def read(cls, text: str) -> Load:
        """Read what somebody typed.

        Raises
        ------
        InvalidSettings

        Examples
        --------
        >>> Load.read("spring:0.5"), Load.read("blocked").label
        (Load(kind='spring', value=0.5), 'blocked')
        """
        kind, colon, value = text.partition(":")
        if kind not in get_args(LoadKind) or bool(colon) != (kind in ("spring", "force")):
            raise InvalidSettings(
                f"load {text!r}: expected free, blocked, spring:STIFFNESS or force:FORCE"
            )
        try:
            number = float(value) if colon else 0.0
        except ValueError:
            raise InvalidSettings(f"load {text!r}: {value!r} is no number") from None
        return cls(cast("LoadKind", kind), number)
