"""States of a part at fractions of its stroke, as movies show them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import FrameEvaluator
from bellcrank.mechanics.stroke import at_fraction
from bellcrank.model import Loads, NodeForce, find_problem, human_design
from bellcrank.part import PartSpec, frame_problem
from bellcrank.workflows.loading import loading_path


def test_loads_grow_with_the_input_in_a_movie_as_on_the_path() -> None:
    design = human_design("crane")
    problem = frame_problem(find_problem("crane"), PartSpec())
    force = NodeForce(problem.output.nodes, [0.0, -0.01])
    loaded = replace(problem, loads=Loads(forces=(force,), weight=np.array([0.0, -1e-3])))
    path = loading_path(replace(design, problem=loaded), np.array([0.0, 0.25, 0.5, 1.0]))
    evaluator = FrameEvaluator(loaded)
    evaluator.evaluate(design.mask, 1 / 64)
    nodes = len(loaded.lattice.positions)
    for fraction, motion in zip(path.fraction[1:], path.displacement[1:], strict=True):
        here = evaluator.equilibrium(float(fraction))
        assert here is not None
        assert motion == pytest.approx(here.state.u[:nodes, :2], abs=1e-8)
    half = at_fraction(loaded, 0.5)
    assert half.loads.forces[0].force == pytest.approx(0.5 * force.force)
    assert half.loads.weight == pytest.approx([0.0, -5e-4])
