"""All there is to say about an actuator as a two-port."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.curves import PortCurve, trace
from bellcrank.machines.loads import Load
from bellcrank.machines.ports import Port, block_ports, mean_ports, ports_of
from bellcrank.machines.sampling import Fit, fit
from bellcrank.machines.two_port import TwoPort, two_port_at
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.provenance import provenance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics import Superelement, UnloadedBeams
    from bellcrank.model import Design

DEGREES = {"mean": (2, 3, 4, 5, 6, 7, 8), "block": (2, 3, 4)}
"""Of the potentials that are tried."""
AGREEMENT = 1e-6
"""Of the free efficiency at the full stroke with that of the response, beyond which the curve and
the response are on different branches."""


@dataclass(frozen=True, slots=True, eq=False)
class Characterisation:
    """An actuator as a two-port; what `bellcrank characterise` prints and keeps.

    Lengths and forces in lattice units; forces are those from outside on the actuator.

    Parameters
    ----------
    name
        Of the problem.
    problem_hash, mask
        What tells the design from others.
    beams
        How many it has.
    unloaded_beams
        What counts of it.
    drive
        Of the problem: ``"displacement"`` or ``"force"``.
    input, output
        The ports.
    rest
        The linear two-port at rest.
    blocks : (6, 6)
        Stiffness at rest by both ports as rigid blocks: x, y, rotation of the input, then of the
        output; None if the structure does not hold the output.
    curves
        Along the stroke, one for each load.
    potentials
        By ``"mean"`` or ``"block"``: fitted to the nonlinear answers, if that was asked for.
    doubts
        What is to be known before relying on it, in sentences.
    provenance
    """

    name: str
    problem_hash: str
    mask: str
    beams: int
    unloaded_beams: UnloadedBeams
    drive: str
    input: Port
    output: Port
    rest: TwoPort
    blocks: NDArray[np.float64] | None
    curves: tuple[PortCurve, ...]
    potentials: dict[str, Fit] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    provenance: dict[str, Any] = field(default_factory=dict)


def usual_loads(rest: TwoPort) -> tuple[Load, ...]:
    """Return the loads that say most: free, blocked, and a spring that takes the most work."""
    if not rest.connected:
        return (Load("free"),)
    loads = (Load("free"), Load("blocked"))
    if not 0.0 < rest.matched_spring < np.inf:
        return loads
    # A figure that can be typed again.
    return (*loads, Load("spring", float(f"{rest.matched_spring:.3g}")))


def characterise(
    design: Design,
    loads: Sequence[Load] | None = None,
    points: int = 20,
    *,
    unloaded_beams: UnloadedBeams = "keep",
    potentials: bool = False,
) -> Characterisation:
    """Condense an actuator to its ports, at rest and along its stroke.

    The springs of the problem on the output are left out: they are a load like any other.

    Parameters
    ----------
    design
    loads
        What to push against; by default nothing, a wall, and the spring that takes the largest
        share of the work (`usual_loads`).
    points
        Along the stroke.
    unloaded_beams
        As for an `SpringEvaluator`.
    potentials
        Whether to fit potentials, for chains of actuators; takes some seconds.

    Raises
    ------
    InvalidSettings
        If the design is a mechanism, or a load asks for what it cannot do.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> lever = characterise(human_design("crane"), points=4)
    >>> [curve.load.label for curve in lever.curves]
    ['free', 'blocked', 'spring:0.123']
    >>> print(f"{lever.rest.efficiency:.3f} {lever.curves[0].efficiency[-1]:.3f}")
    0.818 1.010
    """
    element = mean_ports(design, unloaded_beams)
    rest = two_port_at(element, element.rest())
    chosen = usual_loads(rest) if loads is None else tuple(loads)
    for load in chosen:
        if not rest.connected and load.kind != "free":
            raise InvalidSettings(
                f"load {load.label}: nothing connects the output of {design.problem.name} to its "
                "input"
            )
    curves = tuple(trace(element, load, points) for load in chosen)
    blocks = block_ports(design, unloaded_beams)
    found = {}
    if potentials and rest.connected:
        views = {"mean": element, "block": blocks}
        found = {name: fit(view, DEGREES[name]) for name, view in views.items()}
    given, wanted = ports_of(design)
    return Characterisation(
        name=design.problem.name,
        problem_hash=design.problem.hash,
        mask=design.mask_hex,
        beams=design.beam_count,
        unloaded_beams=unloaded_beams,
        drive=design.problem.input.drive,
        input=given,
        output=wanted,
        rest=rest,
        blocks=blocks.rest().stiffness if blocks.reached.all() else None,
        curves=curves,
        potentials=found,
        doubts=tuple(_doubts(design, element, rest, curves, found)),
        provenance=provenance(),
    )


def _doubts(
    design: Design,
    element: Superelement,
    rest: TwoPort,
    curves: Sequence[PortCurve],
    potentials: dict[str, Fit],
) -> list[str]:
    """Say what the figures alone do not show."""
    doubts = []
    if not rest.connected:
        doubts.append("nothing connects the output to the input: it stays at rest")
    elif not element.reached.all():
        doubts.append("some of the output's nodes are not connected, and stay at rest")
    doubts += [
        f"{curve.load.label}: loses its stability beyond {curve.reached:.1%} of the stroke"
        for curve in curves
        if curve.status is not Status.CONVERGED
    ]
    free = next((curve for curve in curves if curve.load.kind == "free"), None)
    if free is not None:
        doubts += _doubts_of_branch(design, element, free)
    for name, fitted in potentials.items():
        if fitted.lost:
            total = fitted.lost + fitted.samples + fitted.held_out
            doubts.append(
                f"potential {name}: {fitted.lost} of {total} places in its range snap on the way, "
                "and are left out"
            )
    return doubts


def _doubts_of_branch(design: Design, element: Superelement, free: PortCurve) -> list[str]:
    """Compare the free curve with the response, which looks out for second equilibria."""
    problem = design.problem
    bare = replace(problem, output=replace(problem.output, spring=None, spring_kind=None))
    response = SpringEvaluator(bare, "displacement", element.unloaded_beams).evaluate(
        design.mask, VERIFICATION_INCREMENT
    )
    if response.status is Status.SNAPPED and free.status is Status.CONVERGED:
        return [f"free: {response.status.message}"]
    if free.status is Status.CONVERGED and response.status is Status.CONVERGED:
        moved = response.displacement[problem.output.nodes] * problem.output.direction
        there = float(moved.sum()) / len(problem.output.nodes)
        if abs(there - free.output[-1]) > AGREEMENT * max(1.0, abs(there)):
            return ["free: the curve ends on another branch than the response"]
    return []
