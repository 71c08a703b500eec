"""Pictures of actuators as two-ports, and of the strokes of machines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics import Status
from bellcrank.plots import LoadedCurve, LoadLine, StrokeOfMachine, draw_foretold, draw_two_port

if TYPE_CHECKING:
    import os

    from bellcrank.machines.characterise import Characterisation
    from bellcrank.machines.checking import Check
    from bellcrank.machines.foretelling import Foretold


def draw_characterisation(
    found: Characterisation,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    overwrite: bool = False,
) -> None:
    """Draw the curves of a characterisation, and its load line at the end of the longest stroke.

    Parameters
    ----------
    path
        Where to; the suffix png, svg or pdf chooses the format.
    title
        By default the name of the problem.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
    """
    curves = [
        LoadedCurve(
            name=curve.load.label,
            motion=curve.motion,
            input_force=curve.input_force,
            output=curve.output,
            push=-curve.output_force,
            complete=curve.status is Status.CONVERGED,
        )
        for curve in found.curves
    ]
    rest = found.rest
    line = None
    if rest.connected and found.drive == "displacement" and curves:
        motion = max(float(curve.motion[-1]) for curve in curves)
        line = LoadLine(rest.efficiency * motion, rest.transmitted_stiffness * motion)
    note = (
        f"at rest: efficiency {rest.efficiency:.3g}, input stiffness {rest.input_stiffness:.3g}, "
        f"output stiffness {rest.output_stiffness:.3g}; lattice units"
    )
    draw_two_port(curves, line, path, title=title or found.name, note=note, overwrite=overwrite)


def draw_stroke(
    found: Foretold,
    check: Check | None,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    overwrite: bool = False,
) -> None:
    """Draw what a machine is foretold to do, and what it does if that was simulated.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
    """
    whole_way = found.stroke.status is Status.CONVERGED
    told = StrokeOfMachine(
        found.motion,
        found.output,
        found.input_force,
        complete=whole_way,
    )
    where = "at the full stroke" if whole_way else f"at {found.stroke.reached:.1%} of the stroke"
    note = (
        f"efficiency {found.efficiency:.4g} {where}, {found.linear.efficiency:.4g} for small ones"
    )
    simulated = None
    if check is not None:
        whole = check.simulated
        simulated = StrokeOfMachine(
            whole.motion,
            whole.output,
            whole.input_force,
            complete=whole.status is Status.CONVERGED,
        )
        note += f"; off by {check.output_error:.2%} in motion, {check.force_error:.2%} in force"
    slopes = (found.linear.efficiency, found.linear.input_stiffness)
    draw_foretold(
        told, slopes, path, simulated=simulated, title=title, note=note, overwrite=overwrite
    )
