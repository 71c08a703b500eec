"""Movies of searches: the accepted designs that lead to the result of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Core, SpringEvaluator, Status
from bellcrank.model import read_design
from bellcrank.plots.movies import (
    Graph,
    Line,
    Movie,
    MovieSettings,
    StateSequence,
    check_movie,
    max_states,
    pick_states,
    search_schedule,
    write_movie,
)
from bellcrank.search import SearchSettings, read_settings, searches
from bellcrank.storage import RunFolder
from bellcrank.workflows.animate import efficiency_note, no_progress

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.workflows.animate import Progress

LONG = 300
"""Number of steps from which their axis is logarithmic."""


@dataclass(frozen=True, slots=True, eq=False)
class ChainHistory:
    """The designs of a chain up to its best, or to the selected one.

    Parameters
    ----------
    chain
        Number of the chain.
    step : (n,) int64
        Number of proposals after which each design was accepted; 0 for the initial design.
    mask : (n, M) bool
    efficiency : (n,) float64
        Efficiency as evaluated by the search.
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
    progress: Progress = no_progress,
) -> None:
    """Write a movie of the accepted designs of the best chain of a run, each at full stroke.

    For a search that accepts losses, only designs better than all previous ones are shown.
    Beams that the search did not count, such as dead ends, are not drawn.

    Parameters
    ----------
    folder
        Folder of a run, finished or not.
    path
        Output file; the suffix mp4 or gif selects the format.
    settings
        Length, frame rate, size.
    magnify
        Factor by which the drawn displacement is larger than the computed one.
    overwrite
        Whether an existing file is replaced.
    progress
        Called with the current activity, the number of finished steps, and their total.

    Raises
    ------
    InvalidFile, CorruptRun
        If the folder is not that of a run, or is damaged.
    InvalidSettings
        If the run has accepted no design, or a setting is invalid.
    OutputExists, StorageError
        If the file exists or cannot be written.
    """
    check_movie(path, overwrite=overwrite)
    write_movie(
        search_movie(RunFolder.open(folder), settings, magnify=magnify, progress=progress),
        path,
        settings,
        overwrite=overwrite,
        progress=lambda done: progress("drawing", done, settings.frames),
    )


def search_movie(
    folder: RunFolder,
    settings: MovieSettings,
    *,
    magnify: float = 1.0,
    progress: Progress = no_progress,
) -> Movie:
    """Compute the movie of `animate_search`; arguments and errors are the same."""
    search = read_settings(folder.settings)
    history = read_history(folder, search)
    limit = max_states(settings.frames, settings.fps)
    picked = pick_states(history.efficiency, history.step, max(2, limit - 1))
    if len(picked) < limit:
        # The last design is repeated once without marks of added and removed beams.
        picked = np.append(picked, picked[-1])
    sequence = _sequence(folder.problem, search, history, picked, magnify, progress)
    beams = sequence.present.sum(axis=1).astype(np.float64)
    step = history.step.astype(np.float64)
    lines = (
        ("efficiency", Line(step, history.efficiency, picked)),
        ("beams", Line(step[picked], beams, np.arange(len(picked)))),
    )
    graphs = tuple(
        Graph("proposals", label, (line,), preview=False, logarithmic=bool(step[-1] > LONG))
        for label, line in lines
    )
    return Movie((sequence,), graphs, search_schedule(settings.frames, len(picked)))


def read_history(folder: RunFolder, settings: SearchSettings) -> ChainHistory:
    """Read the chain that leads to the selected design, or to the best one so far.

    Raises
    ------
    CorruptRun
        If the run is damaged.
    InvalidSettings
        If the run has accepted no design.
    """
    chain, last = _goal(folder, settings)
    records = folder.read(chain, ["step", "mask", "efficiency", "accepted", "status"])
    taken = np.flatnonzero(_accepted(records) & (records["step"] <= last))
    if len(taken) == 0:
        raise _no_design(folder)
    problem = folder.problem
    first = _evaluator(problem, settings).evaluate(problem.initial).efficiency
    efficiency = records["efficiency"][taken]
    if searches[settings.name].plot_running_best:
        # Designs with a larger efficiency than the selected one failed the verification.
        seen = np.where(efficiency <= efficiency[-1], efficiency, -np.inf)
        better = seen > np.maximum.accumulate(np.append(first, seen[:-1]))
        better[-1] = True
        taken = taken[better]
    masks = np.unpackbits(records["mask"][taken], axis=1, count=problem.lattice.beam_count)
    return ChainHistory(
        chain,
        np.append(0, records["step"][taken] + 1),
        np.concatenate([problem.initial[None], masks.astype(bool)]),
        np.append(first, records["efficiency"][taken]),
    )


def _goal(folder: RunFolder, settings: SearchSettings) -> tuple[int, int]:
    """Return chain and step of the selected design, or of the best one so far."""
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
        raise _no_design(folder)
    _, chain, step = max(found)
    return -chain, step


def _no_design(folder: RunFolder) -> InvalidSettings:
    return InvalidSettings(f"{folder.path}: the search has accepted no design yet")


def _accepted(records: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Mark the accepted proposals with a converged response."""
    converged = (records["status"] == Status.CONVERGED) & np.isfinite(records["efficiency"])
    taken: NDArray[np.bool_] = records["accepted"] & converged
    return taken


def _evaluator(problem: Problem, settings: SearchSettings) -> SpringEvaluator:
    """Return an evaluator with the objective and beam rule of a search."""
    return SpringEvaluator(problem, settings.objective, settings.unloaded_beams)


def _sequence(
    problem: Problem,
    settings: SearchSettings,
    history: ChainHistory,
    picked: NDArray[np.int64],
    magnify: float,
    progress: Progress,
) -> StateSequence:
    """Compute the responses of designs and return them as states of one lattice."""
    evaluator = _evaluator(problem, settings)
    core = Core(evaluator)
    masks = history.mask[picked]
    load_bearing = np.array([core.of(mask) for mask in masks])
    held = np.isin(problem.lattice.beams, problem.supports.fixed).all(axis=1)
    present = masks if settings.unloaded_beams == "keep" else load_bearing | (masks & held)
    displacement = []
    for done, mask in enumerate(masks):
        displacement.append(evaluator.evaluate(mask).displacement)
        progress("loading", done + 1, len(picked))
    drawn = "" if magnify == 1.0 else f" · motion drawn × {magnify:g}"
    notes = tuple(
        f"{beams} beams · {efficiency_note(efficiency)} · after {step} proposals{drawn}"
        for beams, efficiency, step in zip(
            present.sum(axis=1), history.efficiency[picked], history.step[picked], strict=True
        )
    )
    return StateSequence(
        problem=problem,
        present=present,
        load_bearing=load_bearing,
        displacement=np.array(displacement),
        energy=None,
        title=f"{problem.name}, chain {history.chain + 1} of {settings.chains}",
        notes=notes,
        alarms=("",) * len(picked),
        magnify=magnify,
    )
