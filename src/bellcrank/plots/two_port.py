"""An actuator as a two-port: curves along its stroke against loads, and its load line."""

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
"""Of the figure, in inches."""
MARGIN, TOP, BOTTOM, GAP = 0.75, 1.05, 0.62, 0.85
COLOURS = (style.OUTPUT, style.INPUT, style.BUILT, "#cc79a7", "#e69f00", "#56b4e9", style.INK)
"""Of the curves, one after the other (Okabe and Ito, 2008)."""


@dataclass(frozen=True, slots=True, eq=False)
class LoadedCurve:
    """What an actuator does along its stroke against one load.

    Parameters
    ----------
    name
        Of the load.
    motion, input_force, output, push : (p,)
        Motion of and force on the input; motion of the output, and the force with which it
        pushes on its load.
    complete
        Whether it is stable up to the full stroke.
    """

    name: str
    motion: NDArray[np.float64]
    input_force: NDArray[np.float64]
    output: NDArray[np.float64]
    push: NDArray[np.float64]
    complete: bool


@dataclass(frozen=True, slots=True)
class LoadLine:
    """The linear answer at one input motion: from a free to a blocked output.

    Parameters
    ----------
    free
        Motion of a free output.
    blocked
        Push of a blocked one.
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
    """Draw output motion and input force along the stroke, and where the strokes end.

    Parameters
    ----------
    curves
        One for each load.
    line
        Drawn beside the ends of the strokes, if there is one.
    path
        Where to; the suffix png, svg or pdf chooses the format.

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
    style.write_heading(figure, title, note, MARGIN, 0.22)
    panels = style.row_of_axes(figure, 3, MARGIN, 0.25, TOP, BOTTOM, GAP)
    for curve, colour in zip(curves, _colours(len(curves)), strict=True):
        _draw_curve(panels[0], curve.motion, curve.output, curve, colour)
        _draw_curve(panels[1], curve.motion, curve.input_force, curve, colour)
        _draw_curve(panels[2], curve.output, curve.push, curve, colour)
    if line is not None:
        panels[2].plot(
            [line.free, 0.0], [0.0, line.blocked],
            color=style.NOTE, linewidth=1.1, linestyle=(0, (4, 2)), zorder=1.5,
            label="load line, linear",
        )  # fmt: skip
    words = (
        ("input motion", "output motion"),
        ("input motion", "input force"),
        ("output motion", "push of the output on its load"),
    )
    for axes, (below, beside) in zip(panels, words, strict=True):
        style.label(axes, below, beside, style.SMALL_SIZE)
        style.quieten(axes)
        axes.axhline(0.0, color=style.IDLE, linewidth=0.8, zorder=1.0)
    panels[2].axvline(0.0, color=style.IDLE, linewidth=0.8, zorder=1.0)
    _explain(panels[0], panels[2], has_line=line is not None)
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
    """Draw one curve; its end is a dot, or a cross where stability is lost."""
    axes.plot(across, up, color=colour, linewidth=1.6, label=curve.name)
    marker, size = ("o", 5.0) if curve.complete else ("X", 8.0)
    axes.plot(
        across[-1:], up[-1:],
        color=colour, marker=marker, markersize=size, linestyle="none", clip_on=False, zorder=3.0,
    )  # fmt: skip


def _explain(first: Axes, last: Axes, *, has_line: bool) -> None:
    """Say which curve is which, above the panels, where none can be hidden."""
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
