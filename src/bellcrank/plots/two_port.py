"""Two-port characteristics of an actuator: curves against loads, and the load line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.plots import style
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    import numpy as np
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

SIZE = (11.4, 4.3)
"""Size of the figure, inches."""
MARGIN, TOP, BOTTOM, GAP = 0.75, 1.05, 0.62, 0.85
COLOURS = (style.OUTPUT, style.INPUT, style.BUILT, "#cc79a7", "#e69f00", "#56b4e9", style.INK)
"""Colours of the curves in order (Okabe and Ito, 2008)."""


@dataclass(frozen=True, slots=True, eq=False)
class LoadedCurve:
    """The response of an actuator along its stroke against one load.

    Parameters
    ----------
    name
        Name of the load.
    motion, input_force : (p,)
        Displacement of the input and force on it.
    output, push : (p,)
        Displacement of the output and its force on the load.
    complete
        Whether all equilibria up to the full stroke are stable.
    """

    name: str
    motion: NDArray[np.float64]
    input_force: NDArray[np.float64]
    output: NDArray[np.float64]
    push: NDArray[np.float64]
    complete: bool


@dataclass(frozen=True, slots=True)
class LoadLine:
    """The linear load line at one input displacement.

    Parameters
    ----------
    free
        Displacement of the free output.
    blocked
        Force of the blocked output.
    """

    free: float
    blocked: float


def draw_two_port(
    curves: Sequence[LoadedCurve],
    line: LoadLine | None,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    note: str = "",
    overwrite: bool = False,
) -> None:
    """Draw output displacement, input force and output force along the stroke.

    Parameters
    ----------
    curves
        One curve for each load.
    line
        Load line, if known.
    path
        Output file; the suffix png, svg or pdf selects the format.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
        As `save_figure`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import numpy as np
    >>> motion = np.linspace(0.0, 1.0, 5)
    >>> lever = LoadedCurve("free", motion, 3.0 * motion, 2.0 * motion, 0.0 * motion, True)
    >>> with TemporaryDirectory() as folder:
    ...     draw_two_port([lever], LoadLine(2.0, 0.5), f"{folder}/lever.png", title="lever")
    """
    check_target(path, overwrite=overwrite)
    figure = style.new_figure(*SIZE)
    style.add_heading(figure, title, note, MARGIN, 0.22)
    panels = style.row_of_axes(figure, 3, MARGIN, 0.25, TOP, BOTTOM, GAP)
    for curve, colour in zip(curves, _colours(len(curves)), strict=True):
        _draw_curve(panels[0], curve.motion, curve.output, curve, colour)
        _draw_curve(panels[1], curve.motion, curve.input_force, curve, colour)
        _draw_curve(panels[2], curve.output, curve.push, curve, colour)
    if line is not None:
        panels[2].plot(
            [line.free, 0.0], [0.0, line.blocked],
            color=style.NOTE, linewidth=1.1, linestyle=(0, (4, 2)), zorder=1.5,
            label="linear load line",
        )  # fmt: skip
    labels = (
        ("input displacement", "output displacement"),
        ("input displacement", "input force"),
        ("output displacement", "output force on the load"),
    )
    for axes, (x_label, y_label) in zip(panels, labels, strict=True):
        style.label_axes(axes, x_label, y_label, style.SMALL_SIZE)
        style.style_axes(axes)
        axes.axhline(0.0, color=style.IDLE, linewidth=0.8, zorder=1.0)
    panels[2].axvline(0.0, color=style.IDLE, linewidth=0.8, zorder=1.0)
    _add_legends(panels[0], panels[2], has_line=line is not None)
    save_figure(figure, path, overwrite=overwrite)


def _colours(count: int) -> list[str]:
    return [COLOURS[number % len(COLOURS)] for number in range(count)]


def _draw_curve(
    axes: Axes,
    across: NDArray[np.float64],
    up: NDArray[np.float64],
    curve: LoadedCurve,
    colour: str,
) -> None:
    """Draw one curve; a dot marks its end, or a cross the loss of stability."""
    axes.plot(across, up, color=colour, linewidth=1.6, label=curve.name)
    marker, size = ("o", 5.0) if curve.complete else ("X", 8.0)
    axes.plot(
        across[-1:], up[-1:],
        color=colour, marker=marker, markersize=size, linestyle="none", clip_on=False, zorder=3.0,
    )  # fmt: skip


def _add_legends(first: Axes, last: Axes, *, has_line: bool) -> None:
    """Add the legends above the panels, where they hide no curve."""
    font = {"family": style.FONT, "size": style.SMALL_SIZE}
    handles, labels = first.get_legend_handles_labels()
    first.legend(
        handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=max(len(labels), 1),
        frameon=False, prop=font, borderaxespad=0.1, handlelength=1.4, columnspacing=1.2,
    )  # fmt: skip
    if has_line:
        handles, labels = last.get_legend_handles_labels()
        last.legend(
            handles[-1:], labels[-1:], loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False,
            prop=font, borderaxespad=0.1, handlelength=1.8,
        )  # fmt: skip
