"""Tasks for elementary actuators, and the struts between them."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.machines import DIRECTIONS, elementary, strut
from bellcrank.mechanics import SpringEvaluator


@pytest.mark.parametrize("columns", [5, 6, 7, 12])
def test_ports_are_hexagons_at_one_height(columns: int) -> None:
    task = elementary(columns, "down")
    centres = []
    for region in (task.input, task.output):
        points = task.lattice.positions[region.nodes]
        centre = points.mean(axis=0)
        away = np.sort(np.linalg.norm(points - centre, axis=1))
        assert away.tolist() == pytest.approx([0.0, *[1.0] * 6], abs=1e-12)
        centres.append(centre)
    assert (centres[0] - centres[1]).tolist() == pytest.approx([columns + 1.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_outputs_are_wanted_in_eight_directions(direction: str) -> None:
    wanted = elementary(7, direction).output.direction
    angle = np.radians(DIRECTIONS[direction])
    assert wanted[0].tolist() == pytest.approx([np.cos(angle), np.sin(angle)])


def test_a_loaded_task_has_springs_on_its_output() -> None:
    assert elementary(7, "up").output.spring is None


def test_a_strut_passes_a_motion_on() -> None:
    bar = strut(5)
    assert SpringEvaluator(bar).evaluate(bar.initial).efficiency == pytest.approx(1.0)
    ends = [bar.lattice.positions[region.nodes].mean(axis=0) for region in (bar.input, bar.output)]
    assert (ends[0] - ends[1]).tolist() == pytest.approx([5.0, 0.0])
    with pytest.raises(InvalidSettings, match="length: expected at least 3, got 2"):
        strut(2)
