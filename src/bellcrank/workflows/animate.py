"""Movies of designs that move from rest to the full stroke and back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import load_bearing_core
from bellcrank.plots.movies import (
    Graph,
    Line,
    Movie,
    MovieSettings,
    StateSequence,
    check_movie,
    stroke_schedule,
    write_movie,
)
from bellcrank.search.verification import ELEMENTS
from bellcrank.task import ProblemUnits, units_of
from bellcrank.workflows.loading import LoadingPath, loading_path
from bellcrank.workflows.validation import spec_for

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.model import Design

    Progress = Callable[[str, int, int], None]

MOST_CASES = 2
"""Largest number of load cases in a movie."""
FIGURE_SPACE = "\u2007"
"""A space as wide as a digit, so that text does not move while numbers grow."""


def no_progress(_activity: str, _done: int, _total: int) -> None:
    """Ignore progress reports."""


@dataclass(frozen=True, slots=True)
class MotionOptions:
    """Options of a movie of a motion.

    Parameters
    ----------
    objective
        Objective that is shown as efficiency; that of the problem by default.
    magnify
        Factor by which the drawn displacement is larger than the computed one.
    """

    objective: str | None = None
    magnify: float = 1.0


def animate_motion(
    designs: Sequence[tuple[str, Design]],
    path: Path,
    settings: MovieSettings,
    options: MotionOptions | None = None,
    *,
    overwrite: bool = False,
    progress: Progress = no_progress,
) -> None:
    """Write a movie of one design, or of two side by side, from rest to the full stroke and back.

    The load cases of one design are shown side by side, at most `MOST_CASES` of them. Each frame
    shows an equilibrium; the colour of a beam shows its strain energy. The return motion repeats
    the forward motion in reverse, also if the design snaps. Designs in space are seen by a camera
    that turns along the stroke. If a design has a specification, all
    are computed with eight elements in each strut, like their items.

    Parameters
    ----------
    designs
        Pairs of a title and a design.
    path
        Output file; the suffix mp4 or gif selects the format.
    settings
        Length, frame rate, size.
    options
        Objective and magnification.
    overwrite
        Whether an existing file is replaced.
    progress
        Called with the current activity, the number of finished steps, and their total.

    Raises
    ------
    InvalidSettings
        If a design has no motion to show, one is in the plane and the other in space, or a setting
        is invalid.
    OutputExists, StorageError
        If the file exists or cannot be written.
    """
    check_movie(path, overwrite=overwrite)
    write_movie(
        motion_movie(designs, settings, options, progress),
        path,
        settings,
        overwrite=overwrite,
        progress=lambda done: progress("drawing", done, settings.frames),
    )


def motion_movie(
    designs: Sequence[tuple[str, Design]],
    settings: MovieSettings,
    options: MotionOptions | None = None,
    progress: Progress = no_progress,
) -> Movie:
    """Compute the movie of `animate_motion`; arguments and errors are the same."""
    options = options or MotionOptions()
    if len({design.problem.lattice.dimension for _, design in designs}) > 1:
        raise InvalidSettings("movie: expected designs in the plane or in space, got both")
    part, order = stroke_schedule(settings.frames)
    states = len(part)
    responses: list[LoadingPath] = []

    def computed(done: int) -> None:
        progress("loading", len(responses) * states + done, len(designs) * states)

    elements = ELEMENTS if any(design.problem.is_specified for _, design in designs) else None
    designs = by_case(in_one_model(designs))
    for _, design in designs:
        responses.append(loading_path(design, part, options.objective, computed, elements))
    shown = [(name, design, way) for (name, design), way in zip(designs, responses, strict=True)]
    sequences = tuple(_sequence(*one, options.magnify, elements) for one in shown)
    return Movie(sequences, _graphs(shown), order)


def by_case(designs: Sequence[tuple[str, Design]]) -> list[tuple[str, Design]]:
    """Return one design of several load cases once for each case, at most `MOST_CASES`.

    Several designs, and a design of one load case, are returned as they are.
    """
    if len(designs) > 1 or len(designs[0][1].problem.cases) == 1:
        return list(designs)
    (_, design), *_ = designs
    cases = list(design.problem.cases.items())[:MOST_CASES]
    return [(name, replace(design, problem=problem)) for name, problem in cases]


def in_one_model(designs: Sequence[tuple[str, Design]]) -> list[tuple[str, Design]]:
    """Return the designs as frames if one of them is a frame.

    The others get its section and its material, because efficiencies of springs and of frames
    cannot be compared.
    """
    frames = [design.problem for _, design in designs if design.problem.section is not None]

    def as_frame(design: Design) -> Design:
        problem = design.problem
        if problem.section is not None or not frames:
            return design
        section, material = frames[0].section, frames[0].material
        return replace(design, problem=replace(problem, section=section, material=material))

    return [(name, as_frame(design)) for name, design in designs]


def _sequence(
    name: str, design: Design, response: LoadingPath, magnify: float, elements: int | None
) -> StateSequence:
    """Return the states of a design along its stroke."""
    word = "stroke" if design.problem.input.drive == "displacement" else "load"
    size = f"{design.beam_count} beams" if magnify == 1.0 else f"motion drawn × {magnify:g}"
    model = "springs" if design.problem.section is None else "frame"
    if elements is not None:
        model += f", {elements} elements"
    # Two headings side by side have no room for the number of beams too.
    size = model if elements is not None and magnify == 1.0 else f"{size} · {model}"
    notes = tuple(
        f"{size} · {word} {_percent(fraction)} · {efficiency_note(efficiency)}"
        for efficiency, fraction in zip(response.efficiency, response.fraction, strict=True)
    )
    snap = f"snaps at {100.0 * response.fraction[response.snapped.argmax()]:.0f} % of the {word}"
    return StateSequence(
        problem=design.problem,
        present=design.mask,
        load_bearing=load_bearing_core(design),
        displacement=response.displacement,
        energy=response.energy,
        title=name,
        notes=notes,
        alarms=tuple(snap if snapped else "" for snapped in response.snapped),
        magnify=magnify,
    )


def _percent(fraction: float) -> str:
    """Format a fraction of the stroke with constant width."""
    return f"{round(100.0 * fraction):d}".rjust(3, FIGURE_SPACE) + " %"


def efficiency_note(efficiency: float) -> str:
    """Format an efficiency."""
    return f"efficiency {efficiency:.3f}" if np.isfinite(efficiency) else "no efficiency"


def _graphs(shown: list[tuple[str, Design, LoadingPath]]) -> tuple[Graph, ...]:
    """Return graphs of the efficiency, and of the conjugate quantity, against the input."""
    drives = {design.problem.input.drive for _, design, _ in shown}
    if len(drives) > 1:
        lines = [_line(name, 100.0 * way.fraction, way.efficiency, way) for name, _, way in shown]
        return (Graph("part of the stroke, %", "efficiency", tuple(lines)),)
    by_motion = drives == {"displacement"}
    of_parts = all(design.problem.section is not None for _, design, _ in shown)
    length, force = ("mm", "N") if of_parts else ("lattice units", "units of the model")
    motion_label, force_label = f"displacement, {length}", f"force, {force}"
    efficiency, conjugate = [], []
    for name, design, response in shown:
        given, output = design.problem.input, design.problem.output
        units = units_of(design.problem, spec_for(design)) if of_parts else ProblemUnits(1.0, 1.0)
        along_output = (response.displacement[:, output.nodes] * output.direction).sum(axis=2)
        x, y = given.amount * response.fraction, along_output.mean(axis=1)
        if by_motion:
            x, y = units.length * x, units.force * response.input_force
        else:
            x, y = units.force * x, units.length * y
        efficiency.append(_line(name, x, response.efficiency, response))
        conjugate.append(_line(name, x, y, response))
    x_label = f"input {motion_label}" if by_motion else f"{force_label}, each input node"
    y_label = f"input {force_label}" if by_motion else f"output {motion_label}"
    return (
        Graph(x_label, "efficiency", tuple(efficiency)),
        Graph(x_label, y_label, tuple(conjugate)),
    )


def _line(name: str, x: NDArray[np.float64], y: NDArray[np.float64], response: LoadingPath) -> Line:
    """Return a curve along the stroke with a gap where the design snaps."""
    at = np.arange(len(x))
    if response.snapped.any():
        snap = int(response.snapped.argmax())
        x, y = np.insert(x, snap, x[snap]), np.insert(y, snap, np.nan)
        at[snap:] += 1
    return Line(x, y, at, name)
