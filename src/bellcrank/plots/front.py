"""Pareto fronts: non-dominated designs in the plane of two objectives."""

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
    """Draw a Pareto front: second objective on the x axis, first on the y axis, third as colour.

    Parameters
    ----------
    points
        Objective values of each design, by name.
    measures
        Names of two or three objectives.
    path
        Output file; the suffix png, svg or pdf selects the format.

    Raises
    ------
    InvalidSettings
        If there are not two or three objectives, or the suffix is unknown.
    OutputExists, StorageError
        If the file exists or cannot be written.
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
    count = f"{len(points)} non-dominated design{'s' * (len(points) != 1)}"
    axes.set_title(f"{title}: {count}" if title else count, fontsize=11)
    axes.grid(alpha=0.25, linewidth=0.6)
    save_figure(figure, target, overwrite=overwrite)
