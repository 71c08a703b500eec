"""Of all the designs that a run has seen, those that no other beats in all respects."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    Core,
    SpringEvaluator,
    Status,
    output_stiffness,
)
from bellcrank.model import Design, pack_mask
from bellcrank.model.storage import write_text
from bellcrank.plots import draw_front
from bellcrank.search import clean, make_evaluator, pieces
from bellcrank.search.goals import GoalEvaluator, ParetoArchive, mass_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search import Evaluator, SearchSettings
    from bellcrank.storage import RunFolder

MOST_DESIGNS = 20_000
"""That are looked at again, the most efficient first."""


def seen_designs(folder: RunFolder, settings: SearchSettings) -> NDArray[np.bool_]:
    """Return (n, M) the designs of a run with a stable response, the most efficient first."""
    masks, efficiency = [], []
    for chain in range(settings.chains):
        records = folder.read(chain, ["mask", "efficiency", "status"])
        stable = np.isin(records["status"], [Status.CONVERGED, Status.UNVERIFIED])
        stable &= np.isfinite(records["efficiency"])
        masks.append(records["mask"][stable])
        efficiency.append(records["efficiency"][stable])
    packed, first = np.unique(np.concatenate(masks), axis=0, return_index=True)
    order = np.argsort(-np.concatenate(efficiency)[first], kind="stable")[:MOST_DESIGNS]
    count = folder.problem.lattice.beam_count
    return np.unpackbits(packed[order], axis=1)[:, :count].astype(bool)


class Scale:
    """Measures designs as they would be built: load-bearing, from rest, with their goals."""

    def __init__(self, problem: Problem, settings: SearchSettings) -> None:
        self.problem = problem
        literal = replace(settings, unloaded_beams="keep")
        self.judge: Evaluator = make_evaluator(problem, literal)
        one = self.judge.evaluators[0] if isinstance(self.judge, GoalEvaluator) else self.judge
        assert isinstance(one, SpringEvaluator)
        self.evaluator = one
        # What no load can reach is not built; left in, it would count in the literal model.
        self.core = Core(SpringEvaluator(problem, "displacement", "prune_all"))

    def measure(
        self, mask: NDArray[np.bool_], largest_increment: float = 1.0
    ) -> dict[str, float] | None:
        """Return the measures of a design; None if it is unstable or breaks a goal."""
        response = self.judge.evaluate(mask, largest_increment)
        if response.status is not Status.CONVERGED:
            return None
        return {
            "efficiency": response.efficiency,
            "stiffness": output_stiffness(self.evaluator),
            "mass": mass_of(self.problem, self.core.of(mask)),
        }

    def clean(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return what of a design would be built."""
        cleaned = clean(Design(self.problem, mask)).mask
        return self.judge.closed(cleaned) if isinstance(self.judge, GoalEvaluator) else cleaned


def find_front(
    folder: RunFolder, settings: SearchSettings, measures: tuple[str, ...]
) -> ParetoArchive:
    """Show all designs of a run to an archive, cleaned and followed carefully from rest."""
    archive = ParetoArchive(measures)
    scale = Scale(folder.problem, settings)
    seen: set[bytes] = set()
    for mask in seen_designs(folder, settings):
        core = scale.core.of(mask)
        if (key := np.packbits(core).tobytes()) in seen:
            continue
        seen.add(key)
        values = scale.measure(core)
        if values is None or not archive.would_keep(values):
            continue
        cleaned = scale.clean(core)
        values = scale.measure(cleaned, VERIFICATION_INCREMENT)
        if values is not None and pieces(folder.problem, cleaned) == 1:
            archive.add(pack_mask(cleaned), values)
    return archive


def write_front(folder: RunFolder, settings: SearchSettings, measures: tuple[str, ...]) -> None:
    """Write ``pareto.json`` and ``pareto.png`` into the folder of a run.

    Raises
    ------
    UnknownName, InvalidSettings
        If the measures are not two or three known ones.
    """
    archive = find_front(folder, settings, measures)
    data: dict[str, Any] = {
        "schema": "bellcrank/pareto/1",
        "problem": folder.problem.name,
        **archive.to_dict(),
    }
    write_text(folder.path / "pareto.json", json.dumps(data, indent=1), overwrite=True)
    draw_front(
        [values for _, values in archive.front()],
        measures,
        folder.path / "pareto.png",
        title=folder.problem.name,
        overwrite=True,
    )
