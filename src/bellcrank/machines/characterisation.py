"""Characterisation of an actuator as a two-port, at rest and along its stroke."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.curves import Load, PortCurve, trace
from bellcrank.machines.ports import Port, mean_ports, ports_of
from bellcrank.machines.two_port import TwoPort, two_port_at
from bellcrank.mechanics import VERIFICATION_INCREMENT, Status, model_evaluator, model_name
from bellcrank.provenance import provenance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.mechanics import Superelement, UnloadedBeams
    from bellcrank.model import Design

BRANCH_TOLERANCE = 1e-6
"""Difference of the output motion at the full stroke, relative to it or to 1, above which the free
curve and the response are on different branches."""


@dataclass(frozen=True, slots=True, eq=False)
class Characterisation:
    """An actuator as a two-port: the record of `bellcrank characterise`.

    Lengths and forces are in lattice units; forces are external forces on the actuator.

    Parameters
    ----------
    name
        Name of the problem.
    problem_hash, mask
        Identity of the design.
    beams
        Number of beams.
    unloaded_beams
        Treatment of unloaded beams.
    model
        Mechanical model: ``"springs"`` or ``"frames"``.
    drive
        Drive of the problem: ``"displacement"`` or ``"force"``.
    input, output
        The ports.
    rest
        Linear two-port at rest.
    curves
        Curves along the stroke, one for each load.
    warnings
        Limits of the results, one sentence each.
    provenance
        Version, time and machine of the computation.
    """

    name: str
    problem_hash: str
    mask: str
    beams: int
    unloaded_beams: UnloadedBeams
    model: str
    drive: str
    input: Port
    output: Port
    rest: TwoPort
    curves: tuple[PortCurve, ...]
    warnings: tuple[str, ...] = ()
    provenance: dict[str, Any] = field(default_factory=dict)


def default_loads(rest: TwoPort) -> tuple[Load, ...]:
    """Return the default loads: free, blocked, and the spring that takes the most work."""
    if not rest.connected:
        return (Load("free"),)
    loads = (Load("free"), Load("blocked"))
    if not 0.0 < rest.matched_spring < np.inf:
        return loads
    # Three digits, so that the load can be typed.
    return (*loads, Load("spring", float(f"{rest.matched_spring:.3g}")))


def characterise(
    design: Design,
    loads: Sequence[Load] | None = None,
    points: int = 20,
    *,
    unloaded_beams: UnloadedBeams = "keep",
) -> Characterisation:
    """Characterise an actuator as a two-port, at rest and along its stroke.

    The springs of the problem at its output are a load, and left out.

    Parameters
    ----------
    design
        Actuator; with a section its beams are those of a frame, without one it is in the spring
        model.
    loads
        Loads at the output; by default those of `default_loads`.
    points
        Number of equal increments of the stroke.
    unloaded_beams
        As for `bellcrank.mechanics.SpringEvaluator`; frames do not depend on them.

    Raises
    ------
    InvalidSettings
        If the design is a mechanism without resistance, or a load is impossible.

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
    chosen = default_loads(rest) if loads is None else tuple(loads)
    for load in chosen:
        if not rest.connected and load.kind != "free":
            raise InvalidSettings(
                f"load {load.label}: expected free, because the output of {design.problem.name} "
                "is not connected to its input"
            )
    curves = tuple(trace(element, load, points) for load in chosen)
    given, wanted = ports_of(design)
    return Characterisation(
        name=design.problem.name,
        problem_hash=design.problem.hash,
        mask=design.mask_hex,
        beams=design.beam_count,
        unloaded_beams=unloaded_beams,
        model=model_name(design.problem),
        drive=design.problem.input.drive,
        input=given,
        output=wanted,
        rest=rest,
        curves=curves,
        warnings=tuple(_warnings(design, element, rest, curves)),
        provenance=provenance(),
    )


def _warnings(
    design: Design, element: Superelement, rest: TwoPort, curves: Sequence[PortCurve]
) -> list[str]:
    """Return the limits of the results, one sentence each."""
    warnings = []
    if not rest.connected:
        warnings.append("the output is not connected to the input: it stays at rest")
    elif not element.reached.all():
        warnings.append("some nodes of the output are not connected: they stay at rest")
    warnings += [
        f"{curve.load.label}: stability is lost at {curve.reached:.1%} of the stroke"
        for curve in curves
        if curve.status is not Status.CONVERGED
    ]
    free = next((curve for curve in curves if curve.load.kind == "free"), None)
    if free is not None and free.status is Status.CONVERGED:
        warnings += _branch_warnings(design, element, free)
    return warnings


def _branch_warnings(design: Design, element: Superelement, free: PortCurve) -> list[str]:
    """Compare the free curve with the response, which detects second equilibria."""
    problem = design.problem
    bare = replace(problem, output=replace(problem.output, spring=None, spring_kind=None))
    response = model_evaluator(bare, "displacement", element.unloaded_beams).evaluate(
        design.mask, VERIFICATION_INCREMENT
    )
    if response.status is Status.SNAPPED:
        return [f"free: {response.status.message}"]
    if response.status is Status.CONVERGED:
        moved = response.displacement[problem.output.nodes] * problem.output.direction
        expected = float(moved.sum()) / len(problem.output.nodes)
        if abs(expected - free.output[-1]) > BRANCH_TOLERANCE * max(1.0, abs(expected)):
            return ["free: the curve ends on another branch than the response"]
    return []
