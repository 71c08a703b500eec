"""The picture of an actuator as a two-port."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics import Status
from bellcrank.plots import LoadedCurve, LoadLine, draw_two_port

if TYPE_CHECKING:
    import os

    from bellcrank.machines.characterise import Characterisation


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
