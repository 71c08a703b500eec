"""The answer of a machine along its whole stroke, foretold from its parts alone.

Blocks that tables or parts join are followed along the stroke (`stroke`). What their ports give,
which blocks leave out, is known for small strokes, from the chain of all nodes of the ports
(`chaining`), and put right there: the curve gets the tangent at rest of that chain.

Which tables: first a linear chain foresees how far each part will be pushed. Where the part's usual
table does not reach, one is made around that way; and should the chain lead out of it all the
same, one more around where it led.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidProblem, InvalidSettings
from bellcrank.machines.blocks import blocks_of
from bellcrank.machines.chaining import predict
from bellcrank.machines.elements import IN, OUT
from bellcrank.machines.ranges import TOLERATED
from bellcrank.machines.standing import Stand, itself, linear, table
from bellcrank.machines.stroke import Straight, Stroke, follow_stroke, straight
from bellcrank.mechanics import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.machines.assembly import Machine
    from bellcrank.machines.blocks import Blocks
    from bellcrank.machines.chaining import Prediction
    from bellcrank.machines.elements import Element
    from bellcrank.machines.sampling import Fit

DOUBTFUL = 0.005
"""Typical error of a table, as a part of its largest answers, that is worth a word."""
BENT = 0.2
"""Part of the linear efficiency that blocks leave out, which is worth a word."""


@dataclass(frozen=True, slots=True, eq=False)
class Foretold:
    """What a machine is foretold to do.

    Lattice units; forces are those from outside. The curves begin at rest.

    Parameters
    ----------
    linear
        For small strokes, by all nodes of the ports.
    motion, output, input_force, energy : (p,)
        Along the stroke.
    stands
        What stood for each part and bridge.
    stroke
        The chain of blocks by itself.
    seconds
        That the stroke took, when all tables were there.
    doubts
        What is to be known before relying on it, in sentences.
    """

    linear: Prediction
    motion: NDArray[np.float64]
    output: NDArray[np.float64]
    input_force: NDArray[np.float64]
    energy: NDArray[np.float64]
    stands: tuple[Stand, ...]
    stroke: Stroke
    seconds: float
    doubts: tuple[str, ...]

    @property
    def efficiency(self) -> float:
        """At the last point of the stroke; nan if there is none beyond rest."""
        return float(self.output[-1] / self.motion[-1]) if len(self.motion) > 1 else np.nan


def foretell(
    machine: Machine,
    points: int = 20,
    *,
    live: bool = False,
    folder: Path | None = None,
    known: Mapping[str, Fit] | None = None,
    tell: Callable[[str], None] | None = None,
) -> Foretold:
    """Foretell what a machine does along its whole stroke.

    Parameters
    ----------
    machine
        Driven by a displacement.
    points
        Number of equal increments of the stroke.
    live
        Follow the parts themselves instead of tables: nothing has to be fitted.
    folder
        Where tables are kept between runs; None keeps none.
    known
        Usual tables that are known already, by part: its potential by blocks, as in a
        `Characterisation`. Not looked at where a part is scaled or lets go of its supports.
    tell
        Is told what is going on.

    Raises
    ------
    InvalidFile
        If it is driven by forces, something in it swings freely, or a port is a single node.
    InvalidSettings
        If there are no points.
    """
    if points < 1:
        raise InvalidSettings(f"points: expected at least one, got {points}")
    blocks = blocks_of(machine)
    exact = predict(machine)
    foreseen = straight(blocks, _linear_elements(blocks))
    stands: tuple[Stand, ...] = ()
    reason = ""
    if not live:
        ways = np.concatenate([foreseen.ports[:, IN], foreseen.forces[:, OUT]], axis=1)
        given = {
            name: found
            for name, found in (known or {}).items()
            if machine.parts[name].supported and machine.parts[name].placement.scale == 1.0
        }
        make = partial(_table, blocks, given, folder, tell or _say_nothing)
        stands, stroke, seconds = _by_tables(blocks, ways, points, make)
        if stroke.status is not Status.CONVERGED:
            # Tables may lose their stability where the parts do not.
            reason = f"by tables, stability is lost at {stroke.reached:.1%} of the stroke"
    if live or reason:
        stands = tuple(itself(member, reason) for member in blocks.members)
        stroke, seconds = _timed(blocks, stands, points)
    # What the ports give is linear: it is added to the curve.
    more = exact.efficiency - foreseen.efficiency
    stiffer = exact.input_stiffness - foreseen.input_stiffness
    return Foretold(
        linear=exact,
        motion=stroke.motion,
        output=stroke.output + more * stroke.motion,
        input_force=stroke.input_force + stiffer * stroke.motion,
        energy=stroke.energy + 0.5 * stiffer * stroke.motion**2,
        stands=stands,
        stroke=stroke,
        seconds=seconds,
        doubts=(*_doubts_of_tables(stands, stroke), *_doubts_of_chain(exact, foreseen, stroke)),
    )


def _say_nothing(_: str) -> None:
    """Tell nobody."""


def _linear_elements(blocks: Blocks) -> list[Element]:
    elements = []
    for member in blocks.members:
        try:
            elements.append(linear(member).element)
        except (InvalidProblem, InvalidSettings) as error:
            raise InvalidFile(
                f"{blocks.source}: {member.name} cannot be chained: {error}"
            ) from None
    return elements


def _timed(blocks: Blocks, stands: Sequence[Stand], points: int) -> tuple[Stroke, float]:
    """Follow the stroke, and say how many seconds that took."""
    start = time.perf_counter()
    stroke = follow_stroke(blocks, [stand.element for stand in stands], points)
    return stroke, time.perf_counter() - start


def _table(
    blocks: Blocks,
    known: Mapping[str, Fit],
    folder: Path | None,
    tell: Callable[[str], None],
    number: int,
    way: NDArray[np.float64],
) -> Stand:
    """Return a table for one member on its way (6,)."""
    member = blocks.members[number]
    tell(f"table of {member.name} ({number + 1} of {len(blocks.members)})")
    return table(member, way, folder, known.get(member.name))


def _by_tables(
    blocks: Blocks,
    ways: NDArray[np.float64],
    points: int,
    make: Callable[[int, NDArray[np.float64]], Stand],
) -> tuple[tuple[Stand, ...], Stroke, float]:
    """Choose tables by where the parts are foreseen to go (e, 6), and again by where they went."""
    kept: dict[int, Stand] = {}
    for last in (False, True):
        stands = tuple(
            kept[number] if number in kept else make(number, way) for number, way in enumerate(ways)
        )
        stroke, seconds = _timed(blocks, stands, points)
        went = way_of(stroke)
        kept = {
            number: stand for number, stand in enumerate(stands) if stand.holds(went[:, number])
        }
        if last or len(kept) == len(stands) or stroke.reached == 0.0:
            break
        ways = went[-1] / stroke.reached
    return stands, stroke, seconds


def way_of(stroke: Stroke) -> NDArray[np.float64]:
    """(p, e, 6) motion of the input of each element and force on its output, along a stroke."""
    return np.concatenate([stroke.ports[:, :, IN], stroke.forces[:, :, OUT]], axis=2)


def _doubts_of_tables(stands: tuple[Stand, ...], stroke: Stroke) -> list[str]:
    doubts = []
    for number, stand in enumerate(stands):
        excess = stand.excess(way_of(stroke)[:, number])
        out = np.flatnonzero(excess > TOLERATED)
        if len(out):
            part = stroke.motion[out[0]] / stroke.motion[-1] * stroke.reached
            doubts.append(
                f"{stand.name} goes beyond the range of its table from {part:.0%} of the stroke "
                f"on, to {excess.max():.3g} times that range"
            )
        if stand.reason:
            doubts.append(f"{stand.name} has no table and is followed itself: {stand.reason}")
        if stand.fit is not None:
            typical = float(stand.fit.typical_error.max())
            if typical > DOUBTFUL:
                doubts.append(f"the table of {stand.name} is off by {typical:.2%} typically")
            if stand.fit.lost:
                doubts.append(
                    f"{stand.name} snaps on the way to {stand.fit.lost} places in the range of "
                    f"its table ({stand.fit.samples} others went into it)"
                )
    return doubts


def _doubts_of_chain(exact: Prediction, foreseen: Straight, stroke: Stroke) -> list[str]:
    doubts = []
    if stroke.status is not Status.CONVERGED:
        doubts.append(f"stability is lost at {stroke.reached:.1%} of the stroke")
    size = max(abs(exact.efficiency), abs(foreseen.efficiency))
    if abs(exact.efficiency - foreseen.efficiency) > BENT * size:
        doubts.append(
            f"ports that give make much of it: the linear efficiency is {exact.efficiency:.4g}, "
            f"with rigid ports {foreseen.efficiency:.4g}"
        )
    return doubts
