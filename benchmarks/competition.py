"""Searches against each other at equal cost: ``python -m benchmarks.competition [--quick]``.

Each problem is searched by plain Metropolis (the paper's chain) and by the default search,
with the same response of a design on both sides, from many seeds. They are compared at equal
numbers of responses and at equal processor time: plain Metropolis goes on until it has had
both the responses and the median time of the other. A flip that leaves what carries load as
it is costs no response on either side; a screening of all flips is no response, but its time
counts. Only designs count that are stable when their path is followed in
small increments.

Results go to ``docs/competition/NAME.json``, the table to standard output.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np
from scipy.stats import mannwhitneyu

from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status, UnloadedBeams
from bellcrank.model import builtin, find_problem
from bellcrank.search import (
    DEFAULT_SEARCH,
    SearchSettings,
    Verdict,
    advance_chain,
    make_evaluator,
    read_settings,
    start_chain,
)

FOLDER = Path(__file__).parents[1] / "docs" / "competition"
PLAIN = "paper"
RESPONSES = {
    "crane": 20_000,
    "anti-parallel": 20_000,
    "scaling-14": 20_000,
    "pliers": 5_000,
    **{name: 20_000 for name in builtin if name.startswith("discs")},
}
FOR_EVER = 10**9
VISIBLE = 2e-3
"""Relative gain of efficiency that is noted in the files."""


@dataclass(frozen=True, slots=True)
class Record:
    """A design better than all before it."""

    efficiency: float
    responses: int
    seconds: float
    mask: str


@dataclass(frozen=True, slots=True)
class Game:
    """One run: when it got how far."""

    seed: int
    responses: int
    seconds: float
    records: list[Record]

    def best(self, responses: float, seconds: float) -> float:
        """Best efficiency within some responses and seconds."""
        return max(
            (
                record.efficiency
                for record in self.records
                if record.responses <= responses and record.seconds <= seconds
            ),
            default=0.0,
        )

    def to_dict(self) -> dict[str, object]:
        """Return the run as plain data: gains that can be seen in a plot, and the best design."""
        curve: list[list[float]] = []
        for record in self.records:
            seen = not curve or record.efficiency - curve[-1][2] > VISIBLE * abs(record.efficiency)
            if seen or record is self.records[-1]:
                curve.append([record.responses, record.seconds, record.efficiency])
        return {
            "seed": self.seed,
            "responses": self.responses,
            "seconds": self.seconds,
            "curve": curve,
            "best": self.records[-1].mask if self.records else None,
        }


@dataclass(frozen=True, slots=True)
class Play:
    """What to play."""

    problem: str
    search: str
    unloaded_beams: str
    seed: int
    responses: int
    seconds: float = 0.0

    @property
    def settings(self) -> SearchSettings:
        """Settings of the search; a chain that may go on has no end."""
        steps = FOR_EVER if self.search == PLAIN else self.responses
        chosen = {"search": self.search, "unloaded_beams": self.unloaded_beams, "seed": self.seed}
        return read_settings({**chosen, "steps": steps})


def play(game: Play) -> Game:
    """Search once, until both responses and processor time are spent."""
    problem, settings = find_problem(game.problem), game.settings
    evaluator = make_evaluator(problem, settings)
    warm_up(game)
    judge = Judge(game)
    state = start_chain(evaluator, settings, 0)
    current, best = state.efficiency, -np.inf
    responses, seconds = 0, 0.0
    found: list[Record] = []
    while state.step < settings.steps and (responses < game.responses or seconds < game.seconds):
        start = time.process_time()
        state, rows = advance_chain(evaluator, settings, 0, state)
        spent = time.process_time() - start
        for index in range(len(rows.status)):
            evaluated = rows.status[index] not in (Verdict.FORBIDDEN, Verdict.REJECTED_EARLY)
            responses += bool(evaluated and rows.efficiency[index] != current)
            if rows.accepted[index]:
                current = rows.efficiency[index]
                if current > best and judge.stands(rows.mask[index]):
                    best = current
                    when = seconds + spent * (index + 1) / len(rows.status)
                    found.append(
                        Record(float(best), responses, when, rows.mask[index].tobytes().hex())
                    )
        seconds += spent
    return Game(game.seed, responses, seconds, found)


def warm_up(game: Play) -> None:
    """Load compiled kernels before the clock starts."""
    settings = replace(game.settings, steps=2)
    evaluator = make_evaluator(find_problem(game.problem), settings)
    advance_chain(evaluator, settings, 0, start_chain(evaluator, settings, 0))
    evaluator.predict_flips(evaluator.problem.initial)


class Judge:
    """Tells, off the clock, whether designs are stable when followed in small increments."""

    def __init__(self, game: Play) -> None:
        self._problem = find_problem(game.problem)
        self._evaluator = SpringEvaluator(
            self._problem, unloaded_beams=game.settings.unloaded_beams
        )
        self._known: dict[bytes, bool] = {}

    def stands(self, packed: np.ndarray) -> bool:
        """Whether a design counts."""
        key = packed.tobytes()
        if key not in self._known:
            mask = np.unpackbits(packed)[: self._problem.lattice.beam_count].astype(bool)
            response = self._evaluator.evaluate(mask, VERIFICATION_INCREMENT)
            self._known[key] = response.status is Status.CONVERGED
        return self._known[key]


def contest(
    name: str, unloaded_beams: str, seeds: int, share: float, pool: ProcessPoolExecutor
) -> dict:
    """Let both searches play a problem; return figures and games."""
    responses = int(RESPONSES[name] * share)
    new = [Play(name, DEFAULT_SEARCH, unloaded_beams, seed, responses) for seed in range(seeds)]
    ours = list(pool.map(play, new))
    seconds = float(np.median([game.seconds for game in ours]))
    old = [replace(game, search=PLAIN, seconds=seconds) for game in new]
    theirs = list(pool.map(play, old))
    result = {
        "problem": name, "unloaded_beams": unloaded_beams,
        "responses": responses, "seconds": seconds,
        "equal responses": figures(ours, theirs, responses, np.inf),
        "equal time": figures(ours, theirs, np.inf, seconds),
    }  # fmt: skip
    games = {DEFAULT_SEARCH: ours, PLAIN: theirs}
    return {**result, "games": {key: [game.to_dict() for game in games[key]] for key in games}}


def figures(ours: list[Game], theirs: list[Game], responses: float, seconds: float) -> dict:
    """Compare the best designs of two searches within a budget."""
    a = np.array([game.best(responses, seconds) for game in ours])
    b = np.array([game.best(responses, seconds) for game in theirs])
    return {
        "median": float(np.median(a)),
        "tenth percentile": float(np.quantile(a, 0.1)),
        "plain median": float(np.median(b)),
        "plain tenth percentile": float(np.quantile(b, 0.1)),
        "ratio": float(np.median(a) / np.median(b)),
        "p": float(mannwhitneyu(a, b, alternative="greater").pvalue),
    }


def print_row(result: dict) -> None:
    """Print a row of the table for each kind of budget."""
    for kind in ("equal responses", "equal time"):
        f = result[kind]
        budget = result["responses"] if kind == "equal responses" else f"{result['seconds']:.1f} s"
        print(
            f"| {result['problem']} | {result['unloaded_beams']} | {budget} "
            f"| {f['plain median']:.3f} "
            f"| {f['median']:.3f} | {f['ratio']:.2f} | {f['tenth percentile']:.3f} "
            f"| {f['p']:.1e} |",
            flush=True,
        )


def main() -> None:
    """Play all problems, or those that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problems", nargs="*", default=list(RESPONSES))
    parser.add_argument("--unloaded-beams", default="prune_all", choices=get_args(UnloadedBeams))
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--quick", action="store_true", help="A tenth of it; leaves no files.")
    options = parser.parse_args()
    seeds, share = (4, 0.1) if options.quick else (options.seeds, 1.0)
    print("| problem | dead ends | budget | plain median | median | ratio | 10th percentile | p |")
    print("|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor(2) as pool:
        for name in options.problems:
            result = contest(name, options.unloaded_beams, seeds, share, pool)
            print_row(result)
            if not options.quick:
                FOLDER.mkdir(parents=True, exist_ok=True)
                target = FOLDER / f"{name}-{options.unloaded_beams}.json"
                target.write_text(json.dumps(rounded(result), indent=None))


def rounded(value: object) -> object:
    """Keep six digits, so that records stay small."""
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [rounded(part) for part in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()
