"""What a machine is foretold to do along its stroke, beside what it does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.plots import style
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os

    import numpy as np
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

SIZE = (8.2, 4.3)
"""Of the figure, in inches."""
MARGIN, TOP, BOTTOM, GAP = 0.75, 1.05, 0.62, 0.95


@dataclass(frozen=True, slots=True, eq=False)
class StrokeOfMachine:
    """A machine's way from rest, in lattice units.

    Parameters
    ----------
    motion, output, force : (p,)
        Of the input, of the output, and on the input.
    complete
        Whether it is stable up to the full stroke.
    """

    motion: NDArray[np.float64]
    output: NDArray[np.float64]
    force: NDArray[np.float64]
    complete: bool


def draw_foretold(
    found: StrokeOfMachine,
    slopes: tuple[float, float],
    path: str | os.PathLike[str],
    *,
    simulated: StrokeOfMachine | None = None,
    title: str = "",
    note: str = "",
    overwrite: bool = False,
) -> None:
    """Draw output motion and input force against input motion.

    Parameters
    ----------
    found
        What is foretold, as lines.
    slopes
        Efficiency and input stiffness for small strokes: dashed lines.
    path
        Where to; the suffix png, svg or pdf chooses the format.
    simulated
        What the whole machine does, as rings.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
        As `save_figure`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import numpy as np
    >>> motion = np.linspace(0.0, 1.0, 5)
    >>> lever = StrokeOfMachine(motion, 2.0 * motion + motion**2, 3.0 * motion, True)
    >>> with TemporaryDirectory() as folder:
    ...     draw_foretold(lever, (2.0, 3.0), f"{folder}/lever.png", title="lever")
    """
    check_target(path, overwrite=overwrite)
    figure = style.new_figure(*SIZE)
    style.add_heading(figure, title, note, MARGIN, 0.22)
    panels = style.row_of_axes(figure, 2, MARGIN, 0.25, TOP, BOTTOM, GAP)
    quantities = (("output", "output motion"), ("force", "input force"))
    for axes, (quantity, words), slope in zip(panels, quantities, slopes, strict=True):
        _draw(axes, found, simulated, quantity, slope)
        style.label_axes(axes, "input motion", words, style.SMALL_SIZE)
        style.style_axes(axes)
        axes.axhline(0.0, color=style.IDLE, linewidth=0.8, zorder=1.0)
    panels[0].legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False,
        prop={"family": style.FONT, "size": style.SMALL_SIZE}, borderaxespad=0.1,
        handlelength=1.4, columnspacing=1.2,
    )  # fmt: skip
    save_figure(figure, path, overwrite=overwrite)


def _draw(
    axes: Axes,
    found: StrokeOfMachine,
    simulated: StrokeOfMachine | None,
    quantity: str,
    slope: float,
) -> None:
    motion, values = found.motion, getattr(found, quantity)
    axes.plot(motion, values, color=style.OUTPUT, linewidth=1.6, label="foretold", zorder=3.0)
    axes.plot(
        motion, slope * motion,
        color=style.NOTE, linewidth=1.1, linestyle=(0, (4, 2)), label="linear", zorder=2.0,
    )  # fmt: skip
    ends = [(found, values, style.OUTPUT)]
    if simulated is not None:
        true = getattr(simulated, quantity)
        axes.plot(
            simulated.motion, true,
            color=style.INPUT, marker="o", markersize=4.5, fillstyle="none", linestyle="none",
            label="simulated", zorder=4.0,
        )  # fmt: skip
        ends.append((simulated, true, style.INPUT))
    for curve, heights, colour in ends:
        if not curve.complete:
            axes.plot(
                curve.motion[-1:], heights[-1:],
                color=colour, marker="X", markersize=8.0, linestyle="none", zorder=5.0,
            )  # fmt: skip
