"""Which pictures a job leaves, and what is in them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.plots import ChainPath, Motion, PathsStyle, draw_comparison, draw_motion, draw_paths
from bellcrank.search import MetropolisSettings, SearchSettings, read_settings, searches
from bellcrank.storage import RunFolder

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Design
    from bellcrank.workflows.outcome import DesignReport


def _annealing(settings: SearchSettings) -> int:
    """Return the accepted steps over which the temperature falls, where there is one."""
    return settings.annealing if isinstance(settings, MetropolisSettings) else 0


def chain_paths(folder: RunFolder, settings: SearchSettings) -> list[ChainPath]:
    """Read the accepted efficiencies of each chain of a run, or the best of them so far."""
    paths = []
    for chain in range(settings.chains):
        columns = folder.read(chain, ["step", "efficiency", "accepted", "status"])
        taken = columns["accepted"] & (columns["status"] == Status.CONVERGED)
        efficiency = columns["efficiency"][taken]
        if searches[settings.name].leaps:
            efficiency = np.fmax.accumulate(efficiency)
        paths.append(ChainPath(efficiency, columns["step"][taken]))
    return paths


def paths_style(folder: RunFolder, settings: SearchSettings) -> PathsStyle:
    """How to draw the chains of a run."""
    if searches[settings.name].leaps:
        return PathsStyle(
            title=folder.problem.name, axis="proposals", measure="best efficiency so far"
        )
    return PathsStyle(title=folder.problem.name, annealing_steps=_annealing(settings))


def draw_run(path: Path, target: Path, *, overwrite: bool = False) -> None:
    """Draw the efficiency along the chains of the run in a folder, finished or not.

    Raises
    ------
    InvalidFile, CorruptRun
        If the folder is not that of a run, or is damaged.
    """
    folder = RunFolder.open(path)
    settings = read_settings(folder.settings)
    paths = chain_paths(folder, settings)
    draw_paths(paths, target, paths_style(folder, settings), overwrite=overwrite)


def move(
    design: Design, objective: str | None = None, *, name: str = "", magnify: float = 1.0
) -> Motion:
    """Compute the response of a design, ready to be drawn."""
    response = SpringEvaluator(design.problem, objective).evaluate(design.mask)
    note = "" if response.status is Status.CONVERGED else response.status.label
    return Motion(
        design, response.displacement, response.efficiency, name=name, note=note, magnify=magnify
    )


def draw_report(report: DesignReport, folder: RunFolder) -> None:
    """Draw ``efficiency.png``, ``motion.png`` and, with a human design, ``comparison.png``."""
    selection = report.selection
    paths = chain_paths(folder, report.settings)
    found = selection.found
    steps = paths[found.chain].step
    assert steps is not None
    best = (found.chain, int(np.searchsorted(steps, found.step)))
    human = report.human_response
    draw_paths(
        paths,
        folder.path / "efficiency.png",
        replace(
            paths_style(folder, report.settings),
            human_efficiency=human.efficiency if human else None,
            built_efficiency=selection.efficiency_after,
            best=best,
        ),
        overwrite=True,
    )
    machine = Motion(
        selection.design,
        selection.response.displacement,
        selection.efficiency_after,
        name="machine",
    )
    draw_motion(machine, folder.path / "motion.png", overwrite=True)
    if report.human is not None and human is not None:
        drawn = Motion(report.human, human.displacement, human.efficiency, name="human")
        draw_comparison(drawn, machine, folder.path / "comparison.png", overwrite=True)
