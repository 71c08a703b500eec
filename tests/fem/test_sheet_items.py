"""Items of a specification in the sheet, beside those of frames with eight elements."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.fem.path import Linearisation, PathStatus, follow_path
from bellcrank.fem.specification import STEPS, sheet_records
from bellcrank.mechanics import VERIFICATION_INCREMENT, item_results
from bellcrank.search import SpecificationEvaluator
from bellcrank.task import task_from_dict
from bellcrank.workflows.part_figures import SHEET_QUANTITIES, part_figures, sheet_figures

if TYPE_CHECKING:
    from numpy.typing import NDArray

pytest.importorskip("ngsolve")

TASK = {
    "name": "small",
    "domain": {"size": ["42 mm", "54 mm"]},
    "supports": [{"at": {"edge": "bottom"}}],
    "cases": [
        {
            "name": "push",
            "inputs": [
                {"at": {"edge": "top", "between": [25, 42]}, "direction": "right",
                 "displacement": "2 mm"},
            ],
            "input_force": {"at_least": "0.01 N"},
            "loads": [
                {"at": {"point": [1, 36]}, "direction": "down", "force": "20 mN"},
                {"at": {"point": [41, 36]}, "direction": "right", "spring": "0.02 N/mm"},
            ],
            "outputs": [
                {"name": "tip", "at": {"edge": "top", "between": [0, 16]}, "direction": "right",
                 "gain": {"at_least": 0.1}, "off_axis": 2, "rotation": "40 deg", "sag": 2,
                 "payload": "1 g", "dead_load": "1 g", "stiffness": "0.001 N/mm",
                 "blocked_force": "1 mN",
                 "path": {"points": [[0, 0], [2, 0]], "error": "50%"}},
                {"name": "side", "at": {"point": [41, 27]}, "direction": "right",
                 "travel": "0.01 mm", "rotation": "40 deg"},
            ],
        },
        {
            "name": "pull",
            "inputs": [
                {"at": {"edge": "top", "between": [25, 42]}, "direction": "up",
                 "displacement": "1 mm"},
            ],
            "gravity": "down",
            "outputs": [
                {"at": {"edge": "top", "between": [0, 16]}, "direction": "up",
                 "travel": "0.01 mm"},
            ],
        },
    ],
    "limits": {"stable_stroke": 1.1, "mass": "8 g", "strut_loss": "95%"},
}  # fmt: skip
DEVIATION = {
    "strain": 1.5, "clearance": 0.0, "path_error": 0.5, "off_axis": 0.4, "rotation": 0.3,
}  # fmt: skip
"""Largest relative deviation of the sheet from the frame; that of the others is `USUAL`. Hubs make
the sheet stiffer, and corners strain it more."""
USUAL = 0.25


class Spring:
    """The tangent stiffness of `SofteningSpring`."""

    nonsingular = True

    def __init__(self, value: float) -> None:
        self.value = value
        self.negative_eigenvalues = int(value < 0.0)

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        return right / self.value


class SofteningSpring:
    """A spring whose stiffness falls to a two hundredth of its mean at half the load."""

    count, kinks = 1, ()
    least = 0.005

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearisation:
        moved = unknowns - 0.5
        force = 0.5 + (4.0 * moved**3 + self.least * moved) / (1.0 + self.least)
        stiffness = (12.0 * moved[0] ** 2 + self.least) / (1.0 + self.least)
        return Linearisation(force - load, 1e-9, Spring(stiffness))

    def load_derivative(
        self, unknowns: NDArray[np.float64], load: float, toward: float = 1.0
    ) -> NDArray[np.float64]:
        del unknowns, load, toward
        return np.array([-1.0])

    def distance(self, change: NDArray[np.float64]) -> float:
        return float(np.abs(change).max())


def test_a_path_that_is_nearly_unstable_is_followed_to_its_end() -> None:
    assert follow_path(SofteningSpring(), STEPS).status is PathStatus.CONVERGED


@pytest.mark.slow
def test_channels_in_the_sheet_are_the_same_in_each_run() -> None:
    task = task_from_dict({**TASK, "cases": TASK["cases"][1:]})
    part = task.part.of(task.problem.full_design())
    first, second = (sheet_records(part, size=1.5) for _ in range(2))
    assert first is not None
    assert second is not None
    for channel, values in first["pull"].channels.items():
        assert np.array_equal(values, second["pull"].channels[channel]), channel


@pytest.mark.slow
def test_all_quantities_in_the_sheet_are_near_those_of_frames() -> None:
    task = task_from_dict(TASK)
    problem = task.problem
    mask = problem.initial.copy()
    ends = problem.lattice.positions[problem.lattice.beams].mean(axis=1)
    inner = np.abs(ends - [2.1, 2.7]).max(axis=1) < 1.1
    mask[inner & np.isin(np.arange(len(mask)), problem.designable)] = False
    evaluator = SpecificationEvaluator(problem, elements=8)
    assert evaluator.evaluate(mask, VERIFICATION_INCREMENT).is_admissible
    frames = evaluator.results()
    design = problem.full_design().with_mask(mask)
    part = task.part.of(design)
    records = sheet_records(part, size=1.0, quantities=SHEET_QUANTITIES)
    assert records is not None
    assert problem.specification is not None
    sheet = item_results(problem.specification.items, records)
    assert [each.item.name for each in sheet] == [each.item.name for each in frames]
    for one, other in zip(frames, sheet, strict=True):
        if math.isinf(one.value):
            assert math.isinf(other.value), one.item.name
            continue
        limit = DEVIATION.get(one.item.quantity, USUAL)
        assert other.value == pytest.approx(one.value, rel=limit, abs=1e-3), one.item.name
    figures, expected = sheet_figures(problem, task.part, records), part_figures(design, task.part)
    assert [each["output"] for each in figures] == ["tip", "side", "output"]
    for found, frame in zip(figures, expected, strict=True):
        for key in ("efficiency", "travel_mm", "largest_input_force_N", "strain"):
            limit = DEVIATION["strain"] if key == "strain" else USUAL
            assert found[key] == pytest.approx(frame[key], rel=limit, abs=1e-3), key
    # The sag is that of the output whose specification bounds it.
    assert [each["sag_mm"] is not None for each in figures] == [True, False, False]
