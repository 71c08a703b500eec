"""Refinement of a design that is in a file, and what is left of it when it is stopped."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.model import human_design
from bellcrank.refine import RefinementSettings
from bellcrank.refine.by_frames import MET
from bellcrank.refine.state import is_better, state_of
from bellcrank.workflows.file_refinement import FileRefinement
from tests.refine.designs import unloaded_crane

if TYPE_CHECKING:
    from bellcrank.refine.refinement import Progress


def test_a_refinement_that_is_stopped_keeps_what_it_has_reached() -> None:
    design, stop = unloaded_crane(), threading.Event()
    seen: list[Progress] = []

    def report(progress: Progress) -> None:
        seen.append(progress)
        if progress.rows.violation <= MET:
            stop.set()

    refinement = FileRefinement(design, RefinementSettings())
    assert refinement.run(report, stop) is None
    found = refinement.reached()
    assert found.reason == "stopped"
    assert found.improved
    assert is_better(found.after, found.before)
    assert found.steps >= seen[-1].step > 0
    own = state_of(found.design.problem, found.design.mask)
    assert own.objective == found.after.objective
    assert found.design.provenance["refinement"]["steps"] == found.steps
    assert found.design.efficiency is not None
    moved = found.design.problem.lattice.positions - design.problem.lattice.positions
    assert 1e-3 < np.abs(moved).max() <= 0.9 + 1e-9


def test_a_refinement_that_is_stopped_before_its_first_step_leaves_the_design() -> None:
    design, stop = unloaded_crane(), threading.Event()
    stop.set()
    refinement = FileRefinement(design, RefinementSettings())
    assert refinement.run(stop=stop) is None
    found = refinement.reached()
    assert not found.improved
    assert found.design is design


def test_designs_of_springs_are_refused() -> None:
    refinement = FileRefinement(human_design("crane"), RefinementSettings())
    with pytest.raises(InvalidSettings, match="designs of springs are not refined"):
        refinement.run()
