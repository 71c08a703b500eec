"""Contact between struts of the bundled machines, from a record of frame analyses."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files

from bellcrank.errors import UnknownName
from bellcrank.machines.bundled import bundled_machines

RECORD = "contact.json"
"""Results of `check_contact`, written by ``python -m benchmarks.machines --contact``."""


@dataclass(frozen=True, slots=True)
class ContactCheck:
    """Contact between the struts of a part along its stroke.

    Parameters
    ----------
    pairs
        Number of pairs of struts that touch.
    onset
        Fraction of the stroke at which contact first occurs; None without contact.
    """

    pairs: int
    onset: float | None

    @property
    def message(self) -> str:
        """Result in a few words.

        Examples
        --------
        >>> ContactCheck(6, 0.81).message, ContactCheck(0, None).message
        ('struts touch from 81% of the stroke on', 'no contact')
        """
        if self.onset is None:
            return "no contact"
        return f"struts touch from {self.onset:.0%} of the stroke on"


def bundled_contact(name: str) -> ContactCheck:
    """Return the recorded contact of a bundled machine.

    Raises
    ------
    UnknownName

    Examples
    --------
    >>> bundled_contact("reverser").message
    'no contact'
    """
    if name not in bundled_machines():
        known = ", ".join(bundled_machines())
        raise UnknownName(f"unknown machine {name!r}: expected one of {known}")
    text = (files("bellcrank.machines.bundled") / RECORD).read_text(encoding="utf-8")
    row = json.loads(text)["machines"][name]
    return ContactCheck(row["pairs"], row["onset"])
