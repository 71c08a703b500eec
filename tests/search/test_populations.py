"""Many chains scored in batches, and chains that are screened by a scorer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, find_problem
from bellcrank.search import MetropolisSettings, Verdict, chain_blocks
from bellcrank.search.delayed_acceptance import ScreenedSettings
from bellcrank.search.populations import population_steps
from bellcrank.search.scorers import MechanicsScorer
from bellcrank.search.screened import screened_blocks

STEPS = 300


class Weights:
    """A scorer that adds up what each beam is worth."""

    def __init__(self, problem: Problem, bad: float = -np.inf) -> None:
        weight = np.random.default_rng(3).standard_normal(problem.lattice.beam_count)
        self.weight = np.round(6.4 * weight) / 64.0  # sums are exact in whatever order
        self.bad = bad
        self.batches: list[np.ndarray] = []

    def score(self, masks: np.ndarray) -> np.ndarray:
        self.batches.append(masks.copy())
        score = masks @ self.weight
        return np.where(score < self.bad, np.nan, score)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return find_problem("scaling-8")


def test_chains_of_a_population_go_where_those_of_the_compiled_search_go(problem: Problem) -> None:
    settings = MetropolisSettings(steps=STEPS, chains=2, seed=4)
    scorer = MechanicsScorer(SpringEvaluator(problem))
    steps = list(population_steps(problem, scorer, settings, first=5))
    for row in range(2):
        blocks = list(chain_blocks(SpringEvaluator(problem), settings, 5 + row))
        accepted = np.concatenate([rows.accepted for _, rows in blocks])
        temperature = np.concatenate([rows.temperature for _, rows in blocks])
        efficiency = np.concatenate([rows.efficiency for _, rows in blocks])
        sound = np.concatenate([rows.status for _, rows in blocks]) == Status.CONVERGED
        mine = [proposed for _, proposed in steps]
        assert [bool(each.accepted[row]) for each in mine] == accepted.tolist()
        assert [each.temperature[row] for each in mine] == temperature.tolist()
        score = np.array([each.score[row] for each in mine])
        assert np.allclose(score[sound], efficiency[sound], atol=1e-7)
        last = steps[-1][0]
        assert np.packbits(last.masks[row]).tobytes().hex() == blocks[-1][0].mask
        assert last.accepted[row] == accepted.sum()


def test_a_chain_does_not_feel_how_many_run_beside_it(problem: Problem) -> None:
    def course(chains: int, first: int, row: int) -> list[tuple[int, float, bool]]:
        settings = MetropolisSettings(steps=STEPS, chains=chains)
        return [
            (int(each.beam[row]), float(each.score[row]), bool(each.accepted[row]))
            for _, each in population_steps(problem, Weights(problem), settings, first=first)
        ]

    alone = course(1, 7, 0)
    assert course(9, 0, 7) == alone
    assert course(3, 6, 1) == alone
    assert course(1, 8, 0) != alone


@pytest.mark.parametrize("keep", [1, 5])
def test_the_best_different_designs_of_each_chain_are_kept(problem: Problem, keep: int) -> None:
    scorer = Weights(problem)
    settings = MetropolisSettings(steps=STEPS, chains=3, hot=1.0, cold=1.0)
    *_, (last, _) = population_steps(problem, scorer, settings, keep=keep)
    seen = np.stack(scorer.batches[1:])
    for chain in range(3):
        designs = np.unique(np.vstack([seen[:, chain], problem.initial[None]]), axis=0)
        best = np.sort(designs @ scorer.weight)[::-1][:keep]
        ranked = last.kept.ranked(chain)
        assert np.allclose([score for score, _ in ranked], best)
        assert len({packed.tobytes() for _, packed in ranked}) == keep
        for score, packed in ranked:
            mask = np.unpackbits(packed, count=problem.lattice.beam_count)
            assert math.isclose(mask @ scorer.weight, score, abs_tol=1e-12)


def test_a_design_without_a_score_is_never_gone_to(problem: Problem) -> None:
    plain = Weights(problem)
    least = float(plain.score(problem.initial[None])[0]) - 0.05
    settings = MetropolisSettings(steps=STEPS, chains=4, hot=10.0, cold=10.0)
    refused = 0
    for population, proposed in population_steps(problem, Weights(problem, bad=least), settings):
        assert (population.score >= least).all()
        refused += int(np.isnan(proposed.score).sum())
        assert not proposed.accepted[np.isnan(proposed.score)].any()
    assert refused > 50


def test_an_initial_design_without_a_score_is_refused(problem: Problem) -> None:
    with pytest.raises(InvalidSettings, match="cannot start from the initial design"):
        next(population_steps(problem, Weights(problem, bad=np.inf), MetropolisSettings(steps=5)))


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        (MetropolisSettings(moves=("swap",)), "moves"),
        (MetropolisSettings(minimum_degree=2), "minimum_degree"),
        (MetropolisSettings(patience=3), "patience"),
        (MetropolisSettings(goals=("mass <= 0.6",)), "goals"),
        (MetropolisSettings(strokes=(0.5, 1.0)), "strokes"),
    ],
)
def test_rules_that_need_the_mechanics_at_each_step_are_refused(
    problem: Problem, settings: MetropolisSettings, named: str
) -> None:
    with pytest.raises(InvalidSettings, match=f"^{named}: "):
        next(population_steps(problem, Weights(problem), settings))
    with pytest.raises(InvalidSettings, match=f"^{named}: "):
        ScreenedSettings(**{named: getattr(settings, named)})


def course_of(problem: Problem, settings: ScreenedSettings, scorer: object = None):
    scorer = scorer or Weights(problem)
    blocks = list(screened_blocks(SpringEvaluator(problem), scorer, settings, 2))
    columns = {
        name: np.concatenate([getattr(rows, name) for _, rows in blocks])
        for name in ("mask", "efficiency", "accepted", "status")
    }
    return blocks, columns


def test_looking_ahead_changes_nothing_but_the_batches(problem: Problem) -> None:
    settings = ScreenedSettings(steps=STEPS, cost="negative", cold=0.05)
    scorers = [Weights(problem), Weights(problem)]
    (one, first), (many, second) = (
        course_of(problem, replace(settings, lookahead=ahead), scorer)
        for ahead, scorer in zip((1, 32), scorers, strict=True)
    )
    for name, column in first.items():
        assert np.array_equal(column, second[name], equal_nan=name == "efficiency"), name
    assert replace(one[-1][0], scored=0) == replace(many[-1][0], scored=0)
    assert len(scorers[1].batches) < len(scorers[0].batches)
    for (state, _), scorer in zip((one[-1], many[-1]), scorers, strict=True):
        assert state.scored == sum(len(batch) for batch in scorer.batches)


def test_a_screened_chain_counts_what_it_spares_the_mechanics(problem: Problem) -> None:
    blocks, columns = course_of(problem, ScreenedSettings(steps=STEPS))
    state = blocks[-1][0]
    foreseen = columns["status"] == Verdict.REJECTED_EARLY
    assert 0 < state.saved == foreseen.sum() < STEPS
    assert np.isnan(columns["efficiency"][foreseen]).all()
    assert not columns["accepted"][foreseen].any()
    assert state.accepted == columns["accepted"].sum()


def test_a_scorer_that_is_right_leaves_nothing_to_correct(problem: Problem) -> None:
    settings = ScreenedSettings(steps=STEPS, least_chance=1e-12, hot=0.02, cold=0.02)
    scorer = MechanicsScorer(SpringEvaluator(problem))
    blocks, columns = course_of(problem, settings, scorer)
    assert blocks[-1][0].responses == blocks[-1][0].accepted
    assert blocks[-1][0].best >= columns["efficiency"][columns["accepted"]].max()


def test_a_screened_chain_goes_on_from_a_state_between_blocks(problem: Problem) -> None:
    settings = ScreenedSettings(steps=600)
    whole = list(screened_blocks(SpringEvaluator(problem), Weights(problem), settings, 0))
    middle = whole[0][0]
    rest = list(screened_blocks(SpringEvaluator(problem), Weights(problem), settings, 0, middle))
    assert [state for state, _ in rest] == [state for state, _ in whole[1:]]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"least_chance": 0.0}, "least_chance: expected a probability above 0"),
        ({"least_chance": 1.5}, "least_chance: "),
        ({"doubt": -1.0}, "doubt: expected a cost of at least 0"),
        ({"doubt": math.nan}, "doubt: "),
        ({"lookahead": 0}, "lookahead: expected a whole number of at least 1"),
    ],
)
def test_impossible_screening_is_refused(given: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        ScreenedSettings(**given)


def test_an_unknown_cost_is_refused() -> None:
    with pytest.raises(UnknownName, match="unknown cost 'dear'"):
        ScreenedSettings(cost="dear")
