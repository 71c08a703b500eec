"""What stands for each part in a chain: its usual table, one for its work here, or itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.elements import Live, Tabled
from bellcrank.machines.potential import Potential
from bellcrank.machines.ranges import TOLERATED, Range, around
from bellcrank.machines.sampling import fit
from bellcrank.machines.shelf import kept_fit

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.machines.elements import Element
    from bellcrank.machines.members import Member
    from bellcrank.machines.sampling import Fit, Reach
    from bellcrank.mechanics import Superelement

DEGREES = (2, 3, 4)
"""Of the potentials that are tried, as in `bellcrank.machines.characterise`."""
ROUGH = 0.01
"""Typical error of a table, as a part of its largest answers, from which on it is not used: chains
of high gain make ten times as much of it, and following the part itself takes little longer."""

Kind = Literal["usual", "around", "linear", "itself"]


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """What stands for a part or a bridge.

    Parameters
    ----------
    name
        Of the part.
    kind
        ``"usual"``: the table that fits every machine in which the part is not pushed further than
        on its own; ``"around"``: one around its way in this machine; ``"linear"``: it is neither
        moved nor loaded; ``"itself"``: the part, followed.
    element
        For the chain.
    fit, span
        Of a table.
    reason
        Why it is the part itself, if nobody asked for that.
    """

    name: str
    kind: Kind
    element: Element
    fit: Fit | None = None
    span: Range | None = None
    reason: str = ""

    def holds(self, way: NDArray[np.float64]) -> bool:
        """Whether it stands for the part all along its way (p, 6)."""
        return self.span is None or self.excess(way).max() <= TOLERATED

    def excess(self, way: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,) how far out of the range of its table each point of a way is: 1 at the rim."""
        if self.span is None:
            return np.zeros(len(way))
        return np.array([self.span.excess(x) for x in way])


def itself(member: Member, reason: str = "") -> Stand:
    """Let a part stand for itself."""
    return Stand(member.name, "itself", Live(member.body.element), reason=reason)


def linear(member: Member) -> Stand:
    """Let its tangent at rest stand for a part; itself, if nothing holds its output."""
    if member.body.bend is None:
        return itself(member, "nothing holds its output while its input is held")
    return Stand(member.name, "linear", Tabled(_quadratic(member.body.bend)))


def table(
    member: Member, way: NDArray[np.float64], folder: Path | None, known: Fit | None = None
) -> Stand:
    """Let a table stand for a part: the usual one if it reaches, or one around its way.

    Parameters
    ----------
    member
    way : (6,)
        Where it is foreseen to be at the full stroke: motion of its input, force on its output.
    folder
        Where tables are kept, or None.
    known
        Its usual table, if that is known already.
    """
    body = member.body
    if body.bend is None or not way.any():
        return linear(member)
    if body.usual is not None and Range(body.usual[1]).excess(way) <= TOLERATED:
        element, reach = body.usual
        found = known or _fitted(member, element, reach, folder)
        stand = _judged(member, "usual", reach, found)
        if stand.kind == "usual":
            return stand
    reach = around(body, body.bend, way)
    return _judged(member, "around", reach, _fitted(member, body.element, reach, folder))


def _fitted(member: Member, element: Superelement, reach: Reach, folder: Path | None) -> Fit | str:
    """Return a table over a range, or why there is none."""
    try:
        return kept_fit(
            folder, member.body.design, reach, DEGREES, lambda: fit(element, DEGREES, reach)
        )
    except InvalidSettings as error:
        return str(error)


def _judged(member: Member, kind: Kind, reach: Reach, found: Fit | str) -> Stand:
    """Let a table stand for a part, or the part itself if there is none or it is no good."""
    if isinstance(found, str):
        return itself(member, found)
    worst = float(found.typical_error.max())
    if worst > ROUGH:
        return itself(
            member,
            f"a polynomial of degree {found.degree} is off by {worst:.1%} typically in its range"
            + (f", where it snaps in {found.lost} places" if found.lost else ""),
        )
    return Stand(member.name, kind, Tabled(found.potential), found, Range(reach))


def _quadratic(bend: NDArray[np.float64]) -> Potential:
    return Potential(
        prescribed=np.arange(6) < 3,
        quadratic=bend,
        scale=np.ones(6),
        exponents=np.zeros((0, 6), np.int64),
        coefficients=np.zeros(0),
    )
