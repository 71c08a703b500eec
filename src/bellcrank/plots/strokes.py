"""Curves of efficiency and force along the stroke of a part."""

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
    """Equilibria of a part from rest to its full stroke.

    Parameters
    ----------
    stroke : (p,)
        Input displacement in mm, or input force in N for a force drive.
    efficiency : (p,)
    force : (p,)
        Input force in N, or output displacement in mm for a force drive.
    """

    stroke: NDArray[np.float64]
    efficiency: NDArray[np.float64]
    force: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StrokeLabels:
    """Axis labels of the curves, with units."""

    stroke: str = "input displacement, mm"
    force: str = "input force, N"
    efficiency: str = "efficiency"


def draw_strokes(
    pair: tuple[Axes, Axes],
    curves: Sequence[StrokeCurve],
    labels: StrokeLabels,
    names: Sequence[str] = (),
) -> None:
    """Draw efficiencies on the first of two axes and forces on the second.

    Parameters
    ----------
    curves
        One curve, or two: of a human and of a machine design.
    names
        Legend entries of two curves.
    """
    colours = (style.HUMAN, style.OUTPUT) if len(curves) > 1 else (style.OUTPUT,)
    for axes, quantity, label in zip(
        pair, ("efficiency", "force"), (labels.efficiency, labels.force), strict=True
    ):
        for curve, colour in zip(curves, colours, strict=True):
            axes.plot(
                curve.stroke, getattr(curve, quantity),
                color=colour, marker="o", markersize=3.0, linewidth=1.4,
            )  # fmt: skip
        style.label_axes(axes, labels.stroke, label, style.SMALL_SIZE)
        axes.set_xlim(left=0.0)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, 0.0), high + 0.06 * abs(high))
        style.style_axes(axes)
        if len(curves) > 1:
            axes.legend(names, frameon=False, prop={"family": style.FONT, "size": style.SMALL_SIZE})
