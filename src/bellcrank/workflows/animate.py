"""Movies of designs that move: from rest to the full stroke and back."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status, load_bearing_core
from bellcrank.mechanics.strain import strain_of
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

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem

    Tell = Callable[[str, int, int], None]

SMALL = 1e-3
"""Part of the stroke that stands for none, where an efficiency is asked for."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Loading:
    """The way of a design from rest to the full stroke.

    Parameters
    ----------
    part : (K,) float64
        Parts of the stroke, from 0 to 1.
    displacement : (K, N, 2) float64
    energy : (K, M) float64
        Of each beam, as in `Strain`.
    efficiency, input_force : (K,) float64
        The efficiency at rest is that of a small stroke.
    snapped : (K,) bool
        Whether the structure has lost its stability on the way to there.
    """

    part: NDArray[np.float64]
    displacement: NDArray[np.float64]
    energy: NDArray[np.float64]
    efficiency: NDArray[np.float64]
    input_force: NDArray[np.float64]
    snapped: NDArray[np.bool_]


def load_design(
    design: Design,
    part: NDArray[np.float64],
    objective: str | None = None,
    tell: Callable[[int], None] = lambda _done: None,
) -> Loading:
    """Compute the responses of a design at parts of its stroke, each from rest.

    Parameters
    ----------
    part : (K,) float64
        Increasing, from 0 to 1.
    tell
        Called with the number of responses computed.

    Raises
    ------
    InvalidSettings
        If the design is not held, or has no stable equilibrium at its full stroke.
    """
    problem, states = design.problem, len(part)
    displacement = np.zeros((states, *problem.lattice.positions.shape))
    energy = np.zeros((states, problem.lattice.beam_count))
    efficiency, force = np.zeros(states), np.zeros(states)
    snapped = np.zeros(states, dtype=bool)
    for k, share in enumerate(part.tolist()):
        evaluator = SpringEvaluator(_at(problem, max(share, SMALL)), objective)
        # A power of two, so that the increments add up to the whole without a remainder.
        increment = min(
            1.0, 2.0 ** math.floor(math.log2(VERIFICATION_INCREMENT / max(share, SMALL)))
        )
        response = evaluator.evaluate(design.mask, increment)
        if response.status not in {Status.CONVERGED, Status.SNAPPED}:
            raise InvalidSettings(f"{problem.name}: no motion to show: {response.status.message}")
        efficiency[k] = response.efficiency
        snapped[k] = response.status is Status.SNAPPED
        if share > 0.0:
            strain = strain_of(evaluator)
            displacement[k] = response.displacement
            energy[k], force[k] = strain.energy, strain.input_force
        tell(k + 1)
    # What has snapped stays snapped: a single state before may only seem to have.
    snapped = np.logical_and.accumulate(snapped[::-1])[::-1]
    return Loading(part, displacement, energy, efficiency, force, snapped)


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
    ways: list[Loading] = []

    def loaded(done: int) -> None:
        tell("loading", len(ways) * states + done, len(designs) * states)

    for _, design in designs:
        ways.append(load_design(design, part, looks.objective, loaded))
    shown = [(name, design, way) for (name, design), way in zip(designs, ways, strict=True)]
    courses = tuple(_moving(*one, looks.magnify) for one in shown)
    return Movie(courses, _graphs(shown), order)


def _moving(name: str, design: Design, way: Loading, magnify: float) -> Course:
    """Return the course of a design along its stroke."""
    states, beams = way.energy.shape
    bearing = load_bearing_core(design)
    word = "stroke" if design.problem.input.drive == "displacement" else "load"
    size = f"{design.beam_count} beams" if magnify == 1.0 else f"motion drawn × {magnify:g}"
    notes = tuple(
        f"{size} · {word} {_percent(share)} · {efficiency_note(efficiency)}"
        for efficiency, share in zip(way.efficiency, way.part, strict=True)
    )
    snap = f"has snapped at {100.0 * way.part[way.snapped.argmax()]:.0f} % of the {word}"
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


def _graphs(shown: list[tuple[str, Design, Loading]]) -> tuple[Graph, ...]:
    """Return efficiency, and what answers the input, against the input."""
    drives = {design.problem.input.drive for _, design, _ in shown}
    if len(drives) > 1:
        along = [_line(name, 100.0 * way.part, way.efficiency, way) for name, _, way in shown]
        return (Graph("part of the stroke, %", "efficiency", tuple(along)),)
    by_motion = drives == {"displacement"}
    across = "input motion, lattice units" if by_motion else "force on an input node"
    efficiency, answer = [], []
    for name, design, way in shown:
        given, output = design.problem.input, design.problem.output
        along_output = (way.displacement[:, output.nodes] * output.direction).sum(axis=2)
        against = way.input_force if by_motion else along_output.mean(axis=1)
        efficiency.append(_line(name, given.amount * way.part, way.efficiency, way))
        answer.append(_line(name, given.amount * way.part, against, way))
    return (
        Graph(across, "efficiency", tuple(efficiency)),
        Graph(across, "input force" if by_motion else "output motion", tuple(answer)),
    )


def _line(name: str, x: NDArray[np.float64], y: NDArray[np.float64], way: Loading) -> Line:
    """Return a curve along the stroke, broken where the design snaps."""
    at = np.arange(len(x))
    if way.snapped.any():
        snap = int(way.snapped.argmax())
        x, y = np.insert(x, snap, x[snap]), np.insert(y, snap, np.nan)
        at[snap:] += 1
    return Line(x, y, at, name)


def _at(problem: Problem, share: float) -> Problem:
    """Return a problem with a part of its stroke."""
    return replace(problem, input=replace(problem.input, amount=share * problem.input.amount))
