"""Movies of searches: how the design of a run came about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Core, SpringEvaluator, Status
from bellcrank.model import read_design
from bellcrank.plots.movies import (
    Course,
    Graph,
    Line,
    Movie,
    MovieSettings,
    check_movie,
    film,
    most_states,
    pick_states,
    search_schedule,
)
from bellcrank.search import SearchSettings, read_settings, searches
from bellcrank.storage import RunFolder
from bellcrank.workflows.animate import efficiency_note, silent

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.workflows.animate import Tell

LONG = 300
"""Steps from which on their axis is logarithmic."""


@dataclass(frozen=True, slots=True, eq=False)
class Story:
    """The designs of a chain up to its best, or to the one that was chosen.

    Parameters
    ----------
    chain
        Its number.
    step : (n,) int64
        Proposals made when each was accepted; 0 for the design that the chain began with.
    mask : (n, M) bool
    efficiency : (n,) float64
        As the search saw it.
    """

    chain: int
    step: NDArray[np.int64]
    mask: NDArray[np.bool_]
    efficiency: NDArray[np.float64]


def animate_search(
    folder: Path,
    path: Path,
    settings: MovieSettings,
    *,
    magnify: float = 1.0,
    overwrite: bool = False,
    tell: Tell = silent,
) -> None:
    """Film how the design of a run came about: the accepted designs of its best chain, moved.

    Of a search that goes up and down, those are shown that were better than all before. What
    the search left out of account, such as dead ends, is left out of the picture too.

    Parameters
    ----------
    folder
        Of a run, finished or not.
    path
        Where to; the suffix mp4 or gif chooses the format.
    settings
        Length, frames per second, size.
    magnify
        How many times its size the motion is drawn.
    overwrite
        Whether to replace what is there.
    tell
        Called with what is being done, how much of it is done, and how much there is.

    Raises
    ------
    InvalidFile, CorruptRun
        If the folder is not that of a run, or is damaged.
    InvalidSettings
        If the run has accepted nothing yet, or a setting makes no sense.
    OutputExists, StorageError
        If there is such a file, or it cannot be written.
    """
    check_movie(path, overwrite=overwrite)
    film(
        search_movie(RunFolder.open(folder), settings, magnify=magnify, tell=tell),
        path,
        settings,
        overwrite=overwrite,
        tell=lambda done: tell("drawing", done, settings.frames),
    )


def search_movie(
    folder: RunFolder, settings: MovieSettings, *, magnify: float = 1.0, tell: Tell = silent
) -> Movie:
    """Compute what `animate_search` shows; arguments and errors are the same."""
    told = read_settings(folder.settings)
    story = read_story(folder, told)
    most = most_states(settings.frames, settings.fps)
    picked = pick_states(story.efficiency, story.step, max(2, most - 1))
    if len(picked) < most:
        # The last design once more, when it is no longer news what came and went.
        picked = np.append(picked, picked[-1])
    course = _changing(folder.problem, told, story, picked, magnify, tell)
    beams = course.present.sum(axis=1).astype(np.float64)
    step = story.step.astype(np.float64)
    logarithmic = bool(step[-1] > LONG)
    graphs = (
        Graph(
            "proposals", "efficiency", (Line(step, story.efficiency, picked),),
            foreseen=False, logarithmic=logarithmic,
        ),
        Graph(
            "proposals", "beams", (Line(step[picked], beams, np.arange(len(picked))),),
            foreseen=False, logarithmic=logarithmic,
        ),
    )  # fmt: skip
    return Movie((course,), graphs, search_schedule(settings.frames, len(picked)))


def read_story(folder: RunFolder, settings: SearchSettings) -> Story:
    """Read the chain that leads to the chosen design, or to the best one so far.

    Raises
    ------
    CorruptRun
        If the run is damaged.
    InvalidSettings
        If no design was accepted yet.
    """
    chain, last = _goal(folder, settings)
    records = folder.read(chain, ["step", "mask", "efficiency", "accepted", "status"])
    taken = np.flatnonzero(_accepted(records) & (records["step"] <= last))
    if len(taken) == 0:
        raise _nothing(folder)
    problem = folder.problem
    first = _evaluator(problem, settings).evaluate(problem.initial).efficiency
    efficiency = records["efficiency"][taken]
    if searches[settings.name].leaps:
        # What seemed better than the chosen design was looked at closely, and not kept.
        seen = np.where(efficiency <= efficiency[-1], efficiency, -np.inf)
        better = seen > np.maximum.accumulate(np.append(first, seen[:-1]))
        better[-1] = True
        taken = taken[better]
    masks = np.unpackbits(records["mask"][taken], axis=1, count=problem.lattice.beam_count)
    return Story(
        chain,
        np.append(0, records["step"][taken] + 1),
        np.concatenate([problem.initial[None], masks.astype(bool)]),
        np.append(first, records["efficiency"][taken]),
    )


def _goal(folder: RunFolder, settings: SearchSettings) -> tuple[int, int]:
    """Return chain and step of the design that was chosen, or of the best one so far."""
    if (folder.path / "design.json").exists():
        origin = read_design(folder.path / "design.json").provenance
        if isinstance(origin.get("chain"), int) and isinstance(origin.get("step"), int):
            return origin["chain"], origin["step"]
    found: list[tuple[float, int, int]] = []
    for chain in range(settings.chains):
        records = folder.read(chain, ["step", "efficiency", "accepted", "status"])
        taken = np.flatnonzero(_accepted(records))
        if len(taken):
            best = taken[np.argmax(records["efficiency"][taken])]
            found.append((float(records["efficiency"][best]), -chain, int(records["step"][best])))
    if not found:
        raise _nothing(folder)
    _, chain, step = max(found)
    return -chain, step


def _nothing(folder: RunFolder) -> InvalidSettings:
    return InvalidSettings(f"{folder.path}: the search has accepted no design yet")


def _accepted(records: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Mark the proposals that a chain moved to and that count."""
    counts = (records["status"] == Status.CONVERGED) & np.isfinite(records["efficiency"])
    taken: NDArray[np.bool_] = records["accepted"] & counts
    return taken


def _evaluator(problem: Problem, settings: SearchSettings) -> SpringEvaluator:
    """Return what answers as the search did."""
    return SpringEvaluator(problem, settings.objective, settings.unloaded_beams)


def _changing(
    problem: Problem,
    settings: SearchSettings,
    story: Story,
    picked: NDArray[np.int64],
    magnify: float,
    tell: Tell,
) -> Course:
    """Return the course of a lattice from design to design; computes their responses."""
    evaluator = _evaluator(problem, settings)
    core = Core(evaluator)
    masks = story.mask[picked]
    bearing = np.array([core.of(mask) for mask in masks])
    held = np.isin(problem.lattice.beams, problem.supports.fixed).all(axis=1)
    present = masks if settings.unloaded_beams == "keep" else bearing | (masks & held)
    displacement = []
    for done, mask in enumerate(masks):
        displacement.append(evaluator.evaluate(mask).displacement)
        tell("loading", done + 1, len(picked))
    drawn = "" if magnify == 1.0 else f" · motion drawn × {magnify:g}"
    notes = tuple(
        f"{beams} beams · {efficiency_note(efficiency)} · after {step} proposals{drawn}"
        for beams, efficiency, step in zip(
            present.sum(axis=1), story.efficiency[picked], story.step[picked], strict=True
        )
    )
    return Course(
        problem=problem,
        present=present,
        bearing=bearing,
        displacement=np.array(displacement),
        energy=None,
        title=f"{problem.name}, chain {story.chain + 1} of {settings.chains}",
        notes=notes,
        alarms=("",) * len(picked),
        magnify=magnify,
    )
