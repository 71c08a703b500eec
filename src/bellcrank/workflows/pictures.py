"""Which pictures a job leaves, and what is in them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import Evaluator, Status
from bellcrank.plots import ChainPath, Motion, PathsStyle, draw_comparison, draw_motion, draw_paths
from bellcrank.runs import RunFolder
from bellcrank.search import MetropolisSettings

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Design
    from bellcrank.workflows.outcome import DesignReport


def chain_paths(folder: RunFolder, chains: int) -> list[ChainPath]:
    """Read the accepted efficiencies of each chain of a run."""
    paths = []
    for chain in range(chains):
        columns = folder.read(chain, ["step", "efficiency", "accepted"])
        taken = columns["accepted"]
        paths.append(ChainPath(columns["efficiency"][taken], columns["step"][taken]))
    return paths


def draw_run(path: Path, target: Path, *, overwrite: bool = False) -> None:
    """Draw the efficiency along the chains of the run in a folder, finished or not.

    Raises
    ------
    InvalidFile, CorruptRun
        If the folder is not that of a run, or is damaged.
    """
    folder = RunFolder.open(path)
    settings = MetropolisSettings.from_dict(folder.settings)
    shown = PathsStyle(title=folder.problem.name, annealing_steps=settings.annealing)
    draw_paths(chain_paths(folder, settings.chains), target, shown, overwrite=overwrite)


def move(
    design: Design, objective: str | None = None, *, name: str = "", magnify: float = 1.0
) -> Motion:
    """Compute the response of a design, ready to be drawn."""
    response = Evaluator(design.problem, objective).respond(design.mask)
    note = "" if response.status is Status.CONVERGED else response.status.label
    return Motion(
        design, response.displacement, response.efficiency, name=name, note=note, magnify=magnify
    )


def draw_report(report: DesignReport, folder: RunFolder) -> None:
    """Draw ``efficiency.png``, ``motion.png`` and, with a human design, ``comparison.png``."""
    selection = report.selection
    paths = chain_paths(folder, report.settings.chains)
    found = selection.found
    steps = paths[found.chain].step
    assert steps is not None
    best = (found.chain, int(np.searchsorted(steps, found.step)))
    human = report.human_response
    draw_paths(
        paths,
        folder.path / "efficiency.png",
        PathsStyle(
            title=selection.design.problem.name,
            annealing_steps=report.settings.annealing,
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
