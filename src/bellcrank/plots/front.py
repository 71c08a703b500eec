"""Designs that no other beats in all respects, as points in the plane of two measures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from bellcrank.errors import InvalidSettings
from bellcrank.plots import style
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence


def draw_front(
    points: Sequence[Mapping[str, float]],
    measures: Sequence[str],
    path: str | os.PathLike[str],
    *,
    title: str = "",
    overwrite: bool = False,
) -> None:
    """Draw a Pareto front: the second measure across, the first up, the third as colour.

    Parameters
    ----------
    points
        The measures of each design, by name.
    measures
        Two or three names.
    path
        Where to; the suffix png, svg or pdf chooses the format.

    Raises
    ------
    InvalidSettings
        If there are not two or three measures.
    """
    if not 2 <= len(measures) <= 3:
        raise InvalidSettings(f"measures: expected two or three, got {len(measures)}")
    target = check_target(path, overwrite=overwrite)
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.add_subplot()
    columns = [[point[name] for point in points] for name in measures]
    if len(measures) == 3:
        drawn = axes.scatter(columns[1], columns[0], c=columns[2], cmap="viridis", s=26)
        figure.colorbar(drawn, ax=axes, label=measures[2])
    else:
        axes.plot(columns[1], columns[0], "o-", color=style.BEST, markersize=4.5, linewidth=1.0)
    axes.set_xlabel(measures[1])
    axes.set_ylabel(measures[0])
    designs = "design" if len(points) == 1 else "designs"
    axes.set_title(f"{title}: {len(points)} {designs} that no other beats", fontsize=11)
    axes.grid(alpha=0.25, linewidth=0.6)
    save_figure(figure, target)
