"""Motion of the nodes of an output."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bellcrank.mechanics.output import deformation_of


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_a_rigid_motion_has_no_deformation(dimension: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rest = rng.normal(size=(5, dimension))
    angles = rng.uniform(-1.5, 1.5, 3) if dimension == 3 else [0.0, 0.0, rng.uniform(-3.0, 3.0)]
    turn = Rotation.from_rotvec(angles).as_matrix()[:dimension, :dimension]
    moved = rest @ turn.T + rng.normal(size=dimension)
    assert deformation_of(rest, moved - rest) < 1e-12
    stretched = moved + 0.1 * (moved - moved.mean(axis=0))
    farthest = np.linalg.norm(rest - rest.mean(axis=0), axis=1).max()
    assert deformation_of(rest, stretched - rest) == pytest.approx(0.1 * farthest)


def test_a_single_node_has_none() -> None:
    assert math.isnan(deformation_of(np.zeros((1, 2)), np.ones((1, 2))))
