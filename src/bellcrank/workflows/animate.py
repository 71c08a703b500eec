"""Movies of designs that move: from rest to the full stroke and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import load_bearing_core
from bellcrank.plots.movies import (
    Course,
    Graph,
    Line,
    Movie,
    MovieSettings,
    check_movie,
    film,
    stroke_schedule,
)
from bellcrank.workflows.loading import LoadingPath, loading_path

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.model import Design

    Tell = Callable[[str, int, int], None]


FIGURE_SPACE = "\u2007"
"""As wide as a digit, so that words stand still while numbers grow."""


def silent(_what: str, _done: int, _total: int) -> None:
    """Tell nobody."""


@dataclass(frozen=True, slots=True)
class Looks:
    """How a motion is looked at.

    Parameters
    ----------
    objective
        What is called efficiency; the problem's own by default.
    magnify
        How many times its size the motion is drawn.
    """

    objective: str | None = None
    magnify: float = 1.0


def animate_motion(
    designs: Sequence[tuple[str, Design]],
    path: Path,
    settings: MovieSettings,
    looks: Looks | None = None,
    *,
    overwrite: bool = False,
    tell: Tell = silent,
) -> None:
    """Film one design, or two side by side, from rest to the full stroke and back.

    Each frame shows an equilibrium; beams have the colour of their strain energy. A design
    that snaps is drawn back along the way it came.

    Parameters
    ----------
    designs
        With what to call them.
    path
        Where to; the suffix mp4 or gif chooses the format.
    settings
        Length, frames per second, size.
    looks
        What is called efficiency, and how large the motion is drawn.
    overwrite
        Whether to replace what is there.
    tell
        Called with what is being done, how much of it is done, and how much there is.

    Raises
    ------
    InvalidSettings
        If a design has no motion to show, or a setting makes no sense.
    OutputExists, StorageError
        If there is such a file, or it cannot be written.
    """
    check_movie(path, overwrite=overwrite)
    film(
        motion_movie(designs, settings, looks, tell),
        path,
        settings,
        overwrite=overwrite,
        tell=lambda done: tell("drawing", done, settings.frames),
    )


def motion_movie(
    designs: Sequence[tuple[str, Design]],
    settings: MovieSettings,
    looks: Looks | None = None,
    tell: Tell = silent,
) -> Movie:
    """Compute what `animate_motion` shows; arguments and errors are the same."""
    looks = looks or Looks()
    part, order = stroke_schedule(settings.frames)
    states = len(part)
    ways: list[LoadingPath] = []

    def loaded(done: int) -> None:
        tell("loading", len(ways) * states + done, len(designs) * states)

    for _, design in designs:
        ways.append(loading_path(design, part, looks.objective, loaded))
    shown = [(name, design, way) for (name, design), way in zip(designs, ways, strict=True)]
    courses = tuple(_moving(*one, looks.magnify) for one in shown)
    return Movie(courses, _graphs(shown), order)


def _moving(name: str, design: Design, way: LoadingPath, magnify: float) -> Course:
    """Return the course of a design along its stroke."""
    states, beams = way.energy.shape
    bearing = load_bearing_core(design)
    word = "stroke" if design.problem.input.drive == "displacement" else "load"
    size = f"{design.beam_count} beams" if magnify == 1.0 else f"motion drawn × {magnify:g}"
    notes = tuple(
        f"{size} · {word} {_percent(share)} · {efficiency_note(efficiency)}"
        for efficiency, share in zip(way.efficiency, way.fraction, strict=True)
    )
    snap = f"has snapped at {100.0 * way.fraction[way.snapped.argmax()]:.0f} % of the {word}"
    return Course(
        problem=design.problem,
        present=np.broadcast_to(design.mask, (states, beams)),
        bearing=np.broadcast_to(bearing, (states, beams)),
        displacement=way.displacement,
        energy=way.energy,
        title=name,
        notes=notes,
        alarms=tuple(snap if snapped else "" for snapped in way.snapped),
        magnify=magnify,
    )


def _percent(share: float) -> str:
    """Write a part of the stroke, always equally wide."""
    return f"{round(100.0 * share):d}".rjust(3, FIGURE_SPACE) + " %"


def efficiency_note(efficiency: float) -> str:
    """Say how efficient a design is."""
    return f"efficiency {efficiency:.3f}" if np.isfinite(efficiency) else "no efficiency"


def _graphs(shown: list[tuple[str, Design, LoadingPath]]) -> tuple[Graph, ...]:
    """Return efficiency, and what answers the input, against the input."""
    drives = {design.problem.input.drive for _, design, _ in shown}
    if len(drives) > 1:
        along = [_line(name, 100.0 * way.fraction, way.efficiency, way) for name, _, way in shown]
        return (Graph("part of the stroke, %", "efficiency", tuple(along)),)
    by_motion = drives == {"displacement"}
    across = "input motion, lattice units" if by_motion else "force on an input node"
    efficiency, answer = [], []
    for name, design, way in shown:
        given, output = design.problem.input, design.problem.output
        along_output = (way.displacement[:, output.nodes] * output.direction).sum(axis=2)
        against = way.input_force if by_motion else along_output.mean(axis=1)
        efficiency.append(_line(name, given.amount * way.fraction, way.efficiency, way))
        answer.append(_line(name, given.amount * way.fraction, against, way))
    return (
        Graph(across, "efficiency", tuple(efficiency)),
        Graph(across, "input force" if by_motion else "output motion", tuple(answer)),
    )


def _line(name: str, x: NDArray[np.float64], y: NDArray[np.float64], way: LoadingPath) -> Line:
    """Return a curve along the stroke, broken where the design snaps."""
    at = np.arange(len(x))
    if way.snapped.any():
        snap = int(way.snapped.argmax())
        x, y = np.insert(x, snap, x[snap]), np.insert(y, snap, np.nan)
        at[snap:] += 1
    return Line(x, y, at, name)
