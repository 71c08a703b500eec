"""How efficiency and force grow along the stroke of a part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.plots import style

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from matplotlib.axes import Axes
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class StrokeCurve:
    """A part's way from rest to its full stroke.

    Parameters
    ----------
    stroke, efficiency, force : (p,)
        Input motion in mm, or force in N where that is given; efficiency; what stands against
        it on the axis of the force.
    """

    stroke: NDArray[np.float64]
    efficiency: NDArray[np.float64]
    force: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StrokeAxes:
    """Words on the axes of the curves.

    Parameters
    ----------
    stroke, force
        With units.
    """

    stroke: str = "input motion, mm"
    force: str = "input force, N"


def draw_strokes(
    pair: tuple[Axes, Axes],
    curves: Sequence[StrokeCurve],
    words: StrokeAxes,
    names: Sequence[str] = (),
) -> None:
    """Draw efficiencies into one pair of axes' first, forces into its second.

    Parameters
    ----------
    curves
        One, or two: of a design by hand and of one by machine.
    names
        Of the curves, for a legend where there are two.
    """
    shades = (style.HUMAN, style.OUTPUT) if len(curves) > 1 else (style.OUTPUT,)
    for axes, kind, label in zip(
        pair, ("efficiency", "force"), ("efficiency", words.force), strict=True
    ):
        for curve, colour in zip(curves, shades, strict=True):
            axes.plot(
                curve.stroke, getattr(curve, kind),
                color=colour, marker="o", markersize=3.0, linewidth=1.4,
            )  # fmt: skip
        _dress(axes, words.stroke, label)
        if len(curves) > 1:
            axes.legend(names, frameon=False, prop={"family": style.FONT, "size": style.SMALL_SIZE})


def _dress(axes: Axes, below: str, beside: str) -> None:
    """Label axes, quietly."""
    style.label(axes, below, beside, style.SMALL_SIZE)
    axes.set_xlim(left=0.0)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, 0.0), high + 0.06 * abs(high))
    style.quieten(axes)
