"""Benchmarks of frames: published figures, exact solutions and convergence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bellcrank.mechanics import Status
from reproduction.frame_benchmarks.definition import benchmarks
from reproduction.frame_benchmarks.exact import PlaneRod, bend_tip, elastica
from reproduction.frame_benchmarks.frames import BenchmarkFrame, Rigidity
from reproduction.frame_benchmarks.plane import LOADS, MATTIASSON
from reproduction.frame_benchmarks.space import BEND_TORSION, bend_rigidity, ring
from reproduction.frame_benchmarks.study import converged_figures, convergence, largest

RECORD = Path(__file__).parents[2] / "docs" / "studies" / "benchmarks.json"
SHOT = {"bend": (23.56024, 13.60452, 53.47486), "bend-square": (23.8185, 13.7314, 53.6072)}
"""Tip of the 45-degree bend by another shooting solution (`../shared/reference3d`)."""


def test_the_elastica_is_that_of_the_published_table() -> None:
    for load, (deflection, shortening) in zip(LOADS, MATTIASSON, strict=True):
        assert elastica(load)[:2] == pytest.approx((shortening, deflection), abs=5.1e-6)


@pytest.mark.parametrize("name", SHOT)
def test_the_bend_agrees_with_another_shooting_solution(name: str) -> None:
    tip = bend_tip(bend_rigidity(BEND_TORSION[name]), 100.0, np.pi / 4, (300.0, 600.0))
    digits = 6e-6 if name == "bend" else 6e-5
    assert np.abs(tip) == pytest.approx(np.array(SHOT[name]), abs=digits)


def test_a_rod_that_is_pushed_a_little_bends_as_a_beam() -> None:
    # A clamped and hinged beam under a force in its middle: 768 EI / 7 L^3.
    rod = PlaneRod(1e4, 1.0, ((0.5, 0.0, 0.0), (0.5, 0.0, 0.0)), 1, clamped=True)
    assert rod.loads([1e-4])[0] == pytest.approx(768.0 / 7.0 * 1e-4, rel=1e-4)


def test_frames_without_shear_and_with_it_bend_as_beams() -> None:
    for shear, expected in ((np.inf, 1.0 / 3.0), (10.0, 1.0 / 3.0 + 0.1)):
        frame = BenchmarkFrame(
            np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]), Rigidity(1e7, 1.0, shear=shear),
            {0: "xyr"}, load={2: (0.0, 1e-5, 0.0)},
        )  # fmt: skip
        found = frame.respond()
        assert found.status is Status.CONVERGED
        assert found.displacement[-1, 1] == pytest.approx(1e-5 * expected, rel=1e-6)
        assert found.force[0] == pytest.approx([0.0, -1e-5, -1e-5], abs=1e-11)


@pytest.mark.parametrize("name", benchmarks.names())
def test_each_benchmark_converges_to_its_reference(name: str) -> None:
    """With the shooting solutions of the committed record, which take longer than the frames."""
    benchmark = benchmarks[name]
    exact = json.loads(RECORD.read_text(encoding="utf-8"))["figures"]["benchmarks"][name]["exact"]
    reference = np.array(converged_figures(benchmark) if exact is None else exact)
    coarse, fine = (np.array(benchmark.compute(n, False)) for n in benchmark.quick[-2:])
    limit = (4.0 * fine - coarse) / 3.0
    assert limit == pytest.approx(reference, rel=1e-3)
    assert np.abs(fine - reference).max() <= np.abs(coarse - reference).max()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lee-frame", "toggle", "arch"])
def test_the_shooting_solutions_are_those_of_the_record(name: str) -> None:
    exact = benchmarks[name].exact
    assert exact is not None
    recorded = json.loads(RECORD.read_text(encoding="utf-8"))["figures"]["benchmarks"][name]
    assert exact() == pytest.approx(recorded["exact"], rel=1e-5)


def test_elements_with_bowing_converge_at_fourth_order_where_the_axis_is_straight() -> None:
    row: dict[str, Any] = convergence(benchmarks["roll-up"], full=False)
    for kind, order in (("linear", 2.0), ("bowed", 4.0)):
        errors = np.array(largest(row[kind]["errors"]))
        assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(order, abs=0.05)


def test_the_ring_folds_without_moment_and_stays_in_its_plane() -> None:
    found = ring(24, 2.0 * np.pi)
    assert found.reached == 1.0
    # Searches refuse it: the lowest stiffness on the path is below a fifth of that at both ends.
    assert found.status is Status.SNAPPED
    assert found.softest < 0.2
    assert np.abs(found.force[12]).max() < 1e-6 * 1e4
    assert np.abs(found.displacement[:, 2]).max() < 1e-6


def test_all_recorded_errors_are_below_a_tenth_of_a_percent() -> None:
    rows = json.loads(RECORD.read_text(encoding="utf-8"))["figures"]["benchmarks"]
    assert set(rows) == set(benchmarks)
    for row in rows.values():
        for kind in ("linear", "bowed"):
            assert np.abs(row[kind]["errors"][-1]).max() < 1e-3
            assert np.abs(row[kind]["limit_errors"]).max() < 1e-3
