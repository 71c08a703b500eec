"""Chains of searches as plain records, shared by the studies."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.mechanics import VERIFICATION_INCREMENT, Response, Status, model_evaluator
from bellcrank.model import Design, unpack_mask
from bellcrank.plots.downsampling import downsample
from bellcrank.search import (
    Candidate,
    advance_chain,
    candidates_of,
    is_done,
    make_evaluator,
    most_efficient,
    read_settings,
    searches,
    select,
    start_chain,
)
from bellcrank.workflows.design import prepare

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search import Choice, Evaluator, SearchSettings, Selection
    from reproduction.result_store import ResultStore

POINTS = 160
"""Approximate number of stored points of a path."""
OFFERED = 12
"""Number of stored candidate designs of a chain."""
DIGITS = 7


def run_chain(problem: Problem, settings: SearchSettings, chain: int = 0) -> dict[str, Any]:
    """Run one chain and return its results as plain data.

    Returns
    -------
    dict
        steps, accepted, seconds (processor time of the thread), best (largest accepted
        efficiency), last (final efficiency), path (accepted steps and efficiencies, downsampled
        without losing a peak), reached (proposals until efficiencies 0.5, 1 and 2), offered
        (masks, efficiencies and steps of the candidates).
    """
    prepare(problem, settings)  # compiles before the time is measured
    began = time.thread_time()
    evaluator = make_evaluator(problem, settings)
    state = start_chain(evaluator, settings, chain)
    steps: list[NDArray[np.int64]] = []
    masks: list[NDArray[np.uint8]] = []
    values: list[NDArray[np.float64]] = []
    while not is_done(state, settings):
        before = state.step
        state, rows = advance_chain(evaluator, settings, chain, state)
        taken = np.flatnonzero(rows.accepted & (rows.status == Status.CONVERGED))
        steps.append(before + taken)
        masks.append(rows.mask[taken])
        values.append(rows.efficiency[taken])
    seconds = time.thread_time() - began
    step, mask, value = np.concatenate(steps), np.concatenate(masks), np.concatenate(values)
    offers = candidates_of(
        chain, step, mask, value, searches[settings.name].candidate_rule, OFFERED
    )
    return {
        "steps": state.step,
        "accepted": len(value),
        "seconds": round(seconds, 4),
        "best": round(float(value.max(initial=-np.inf)), DIGITS),
        "last": round(float(value[-1]), DIGITS) if len(value) else None,
        "path": downsampled_path(value),
        "reached": {str(mark): _reached(step, value, mark) for mark in (0.5, 1.0, 2.0)},
        "offered": [
            {"mask": each.mask.hex(), "efficiency": each.score, "step": each.step}
            for each in offers
        ],
    }


def _reached(step: NDArray[np.int64], value: NDArray[np.float64], mark: float) -> int | None:
    """Return the number of proposals until an efficiency is first reached, or None."""
    there = np.flatnonzero(value >= mark)
    return int(step[there[0]]) + 1 if len(there) else None


def downsampled_path(value: NDArray[np.float64]) -> dict[str, list[float]]:
    """Return accepted steps and efficiencies, downsampled on a logarithmic axis."""
    if not len(value):
        return {"accepted": [], "efficiency": []}
    accepted = np.arange(1.0, len(value) + 1.0)
    selected = downsample(np.log(accepted), value, POINTS // 4)
    return {
        "accepted": accepted[selected].astype(int).tolist(),
        "efficiency": np.round(value[selected], 4).tolist(),
    }


def run_chains(
    store: ResultStore, what: str, problem: Problem, search: Mapping[str, Any], chains: int
) -> list[dict[str, Any]]:
    """Run chains of a search in parallel; the result of each is stored.

    Parameters
    ----------
    search
        Settings as plain data, including the name of the search.
    """
    settings = read_settings({**search, "chains": chains})
    work = {str(chain): partial(run_chain, problem, settings, chain) for chain in range(chains)}
    return list(store.compute_all(what, work).values())


def best_design(
    problem: Problem,
    chains: Sequence[Mapping[str, Any]],
    judge: Evaluator | None = None,
    choose: Choice = most_efficient,
) -> Selection:
    """Return the best candidate of chains after the removal of unloaded beams.

    Parameters
    ----------
    judge
        Evaluator with the goals of the search; none by default.
    choose
        Function that selects among the admissible candidates.

    Raises
    ------
    InvalidSettings
        If no candidate is stable and connected.
    """
    offers = [
        Candidate(each["efficiency"], number, each["step"], bytes.fromhex(each["mask"]))
        for number, chain in enumerate(chains)
        for each in chain["offered"]
    ]
    return select(problem, offers, None, judge, choose)


def quantiles(values: Sequence[float] | NDArray[np.float64]) -> dict[str, float]:
    """Return minimum, 10th percentile, median, 90th percentile and maximum."""
    found = np.quantile(values, [0.0, 0.1, 0.5, 0.9, 1.0])
    return dict(zip(("least", "low", "median", "high", "largest"), found.tolist(), strict=True))


def design_of(problem: Problem, mask: str) -> Design:
    """Return the design with a mask in hexadecimal."""
    return Design(problem, unpack_mask(mask, problem.lattice.beam_count))


def geometry_of(design: Design) -> dict[str, Any]:
    """Return beams, and positions and widths of a frame, as plain data."""
    problem = design.problem
    if problem.section is None:
        return {"mask": design.mask_hex}
    return {
        "mask": design.mask_hex,
        "positions": problem.lattice.positions.round(6).tolist(),
        "widths": problem.beam_widths.round(6).tolist(),
    }


def design_with(problem: Problem, geometry: Mapping[str, Any]) -> Design:
    """Return the design of `geometry_of`; one without positions and widths has the problem's."""
    if "positions" in geometry:
        problem = problem.with_geometry(
            np.array(geometry["positions"]), np.array(geometry["widths"])
        )
    return design_of(problem, geometry["mask"])


def respond(design: Design, part_of_stroke: float = 1.0) -> Response:
    """Return the response of a design from rest with small increments, in its own model."""
    problem = design.problem
    if part_of_stroke != 1.0:
        given = replace(problem.input, amount=part_of_stroke * problem.input.amount)
        problem = replace(problem, input=given)
    return model_evaluator(problem).evaluate(design.mask, VERIFICATION_INCREMENT)
