"""Problems that do not fit into memory are refused before the work begins."""

from __future__ import annotations

import re
from dataclasses import fields

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import SpringEvaluator, memory
from bellcrank.mechanics.kernels.bundle import Bundle
from bellcrank.mechanics.memory import GIB, available_memory, evaluators_that_fit, memory_needed
from bellcrank.mechanics.ordering import coupled_nodes, elimination_order, factor_size
from bellcrank.mechanics.system import allocate_flip_workspace
from bellcrank.model import Input, Output, Problem, Supports, find_problem, lattices
from bellcrank.search import HoppingSettings, MetropolisSettings, make_evaluator


def square(side: int) -> Problem:
    """A triangular lattice of side x side nodes, held at its foot and pushed at a corner."""
    lattice = lattices["triangular-rows"](
        counts=[side] * side, first_x=[0.5 * ((row + 1) % 2) for row in range(side)]
    )
    last = side * side - 1
    return Problem(
        name="square",
        lattice=lattice,
        supports=Supports(fixed=list(range(side))),
        input=Input([last], [0.0, -1.0], "displacement", 0.1),
        output=Output([last - side + 1], [-1.0, 0.0]),
    )


@pytest.fixture
def eight_gib(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 8 * GIB)


@pytest.mark.usefixtures("eight_gib")
def test_a_lattice_that_is_too_large_is_refused_with_what_fits() -> None:
    problem = square(300)
    with pytest.raises(InvalidSettings) as refusal:
        make_evaluator(problem, HoppingSettings())
    needed, available, without = map(float, re.findall(r"([\d.]+) GiB", str(refusal.value)))
    assert 20.0 < needed < 23.0
    assert available == 8.0
    assert without < 8.0
    side = int(re.findall(r"(\d+) x \1 nodes", str(refusal.value))[0])
    assert "90000 nodes" in str(refusal.value)
    assert memory_needed(side**2, 3 * side**2, predict_flips=True) <= 8 * GIB
    assert memory_needed((side + 1) ** 2, 3 * (side + 1) ** 2, predict_flips=True) > 8 * GIB


@pytest.mark.usefixtures("eight_gib")
def test_strokes_and_chains_count_as_evaluators() -> None:
    problem = square(200)
    assert memory_needed(200**2, 3 * 200**2, predict_flips=True) < 8 * GIB
    with pytest.raises(InvalidSettings, match="GiB"):
        make_evaluator(problem, HoppingSettings(strokes=(0.5, 1.0)))
    assert evaluators_that_fit(problem, 4, predict_flips=True) == 1
    assert evaluators_that_fit(problem, 4, predict_flips=False) == 4
    assert not MetropolisSettings.predicts_flips


def size_of(*bundles: Bundle) -> int:
    """Return the bytes of all arrays of bundles."""
    total = 0
    for bundle in bundles:
        for field in fields(bundle):  # type: ignore[arg-type]
            part = getattr(bundle, field.name)
            if isinstance(part, Bundle):
                total += size_of(part)
            elif isinstance(part, np.ndarray):
                total += part.nbytes
    return total


@pytest.mark.parametrize("name", ["crane", "scaling-20"])
def test_the_estimate_covers_what_is_allocated(name: str) -> None:
    problem = find_problem(name)
    evaluator = SpringEvaluator(problem)
    plain = size_of(evaluator.system, evaluator.structure, evaluator.scratch, evaluator.reference)
    flips = size_of(allocate_flip_workspace(evaluator.system))
    nodes, beams = problem.lattice.node_count, problem.lattice.beam_count
    estimate = memory_needed(nodes, beams)
    whole = memory_needed(nodes, beams, predict_flips=True)
    assert 0.5 * estimate < plain <= estimate
    assert 0.4 * (whole - estimate) < flips <= 1.1 * (whole - estimate)


def test_the_available_memory_is_known() -> None:
    assert GIB // 16 < available_memory() < 2**50


def test_the_capacity_is_that_of_a_dense_symbolic_factorisation() -> None:
    for problem in (square(9), find_problem("discs")):
        beams = problem.lattice.beams.astype(np.int64)
        held = np.zeros(problem.lattice.node_count, dtype=bool)
        held[problem.supports.fixed] = True
        block = elimination_order(beams, held)
        assert sorted(block[~held]) == list(range((~held).sum()))
        pattern = coupled_nodes(beams, held).toarray() != 0.0
        place = np.argsort(block[~held])
        pattern = pattern[np.ix_(place, place)]
        for column in range(len(pattern)):
            below = column + 1 + np.flatnonzero(pattern[column + 1 :, column])
            pattern[np.ix_(below, below)] = True
        assert factor_size(beams, block).entries == np.tril(pattern, -1).sum()
