"""How well single flips are foreseen: by a network, and by low-rank screening beside it.

A network may explain almost all of the variance between designs and yet know little of what a
search asks: which of some hundred flips of the design at hand to try. Here it is asked just that,
and the mechanics says what is true.

Examples
--------
>>> from bellcrank.model import find_problem
>>> crane = find_problem("crane")
>>> effects = flip_effects(crane, crane.initial[None])
>>> effects.exact.shape, effects.efficiency.round(6).tolist()
((1, 203), [-0.064086])
>>> bool(screening_accuracy(effects).pearson[0] > 0.9)
True
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidDataset, InvalidProblem, InvalidSettings
from bellcrank.mechanics import SpringEvaluator
from bellcrank.surrogate.agreement import agreement
from bellcrank.surrogate.predictor import Predictor
from bellcrank.surrogate.trained import TrainedModel

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset


@dataclass(frozen=True, slots=True, eq=False)
class FlipEffects:
    """What the mechanics says of all single flips of some designs.

    Parameters
    ----------
    problem
        What the designs are for.
    masks : (d, M) bool
        The designs.
    beams : (n,) int64
        Which are flipped, one at a time.
    efficiency : (d,) float64
        Of the designs.
    exact : (d, n) float64
        Change of the efficiency by each flip; nan where the flipped design has no unique, stable
        response.
    status : (d, n) int64
        `bellcrank.mechanics.Status` of each flipped design.
    screened : (d, n) float64
        The same change as low-rank screening foresees it; nan where it cannot.
    """

    problem: Problem
    masks: NDArray[np.bool_]
    beams: NDArray[np.int64]
    efficiency: NDArray[np.float64]
    exact: NDArray[np.float64]
    status: NDArray[np.int64]
    screened: NDArray[np.float64]


def flip_effects(problem: Problem, masks: ArrayLike) -> FlipEffects:
    """Compute each design, and each of its single flips of designable beams.

    Parameters
    ----------
    problem
        What the designs are for; judged by its own objective.
    masks : (d, M) bool

    Raises
    ------
    InvalidProblem
        If the masks have not one entry per beam.
    InvalidSettings
        If one of the designs has no unique, stable response, so that nothing can change.
    """
    given = np.asarray(masks, np.bool_)
    if given.ndim != 2 or given.shape[1] != problem.lattice.beam_count:
        raise InvalidProblem(
            f"masks: expected shape (designs, {problem.lattice.beam_count}), one entry for each "
            f"beam of {problem.name!r}, got {given.shape}"
        )
    evaluator = SpringEvaluator(problem)
    beams = np.asarray(problem.designable, np.int64)
    shape = (len(given), len(beams))
    efficiency = np.empty(len(given))
    exact, screened = np.full(shape, np.nan), np.full(shape, np.nan)
    status = np.empty(shape, np.int64)
    for number, mask in enumerate(given):
        response = evaluator.evaluate(mask)
        if not response.is_admissible:
            raise InvalidSettings(
                f"design {number} of {problem.name!r} has no efficiency that flips could change: "
                f"{response.status.message}"
            )
        efficiency[number] = response.efficiency
        foreseen = evaluator.predict_flips(mask, beams)
        if foreseen is not None:
            screened[number] = foreseen.change
        evaluator.set_reference()
        for place, beam in enumerate(beams):
            flipped = mask.copy()
            flipped[beam] = not flipped[beam]
            found = evaluator.evaluate(flipped, warm_start=True)
            status[number, place] = found.status
            if found.is_admissible:
                exact[number, place] = found.efficiency - response.efficiency
    return FlipEffects(problem, given, beams, efficiency, exact, status, screened)


def foreseen_by(
    predictor: Predictor, masks: NDArray[np.bool_], beams: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the change of the predicted efficiency by each flip.

    Parameters
    ----------
    masks : (d, M) bool
    beams : (n,) int64

    Returns
    -------
    (d, n) float64
    """
    change = np.empty((len(masks), len(beams)))
    for number, mask in enumerate(masks):
        asked = np.repeat(mask[None], len(beams) + 1, axis=0)
        asked[np.arange(len(beams)) + 1, beams] ^= True
        said = predictor.predict(asked)
        change[number] = said[1:] - said[0]
    return change


@dataclass(frozen=True, slots=True, eq=False)
class FlipAccuracy:
    """How well flips are foreseen, design by design.

    Parameters
    ----------
    pearson, spearman, recall : (d,) float64
        As in `Agreement`, of each design; nan where it has none.
    flips
        Flips that were looked at, of all designs.

    Examples
    --------
    >>> found = FlipAccuracy(np.array([0.5, 0.7]), np.array([0.4, 0.4]), np.full(2, np.nan), 406)
    >>> found.designs, round(found.to_dict()["pearson"]["mean"], 3)
    (2, 0.6)
    """

    pearson: NDArray[np.float64]
    spearman: NDArray[np.float64]
    recall: NDArray[np.float64]
    flips: int

    @property
    def designs(self) -> int:
        """How many were looked at."""
        return len(self.pearson)

    def to_dict(self) -> dict[str, Any]:
        """Return mean and spread (standard deviation) over the designs as plain data."""
        told: dict[str, Any] = {"designs": self.designs, "flips": self.flips}
        for name in ("pearson", "spearman", "recall"):
            values: NDArray[np.float64] = getattr(self, name)
            known = values[np.isfinite(values)]
            told[name] = {
                "mean": float(known.mean()) if len(known) else None,
                "spread": float(known.std(ddof=1)) if len(known) > 1 else None,
            }
        return told


def compare_flips(foreseen: NDArray[np.float64], exact: NDArray[np.float64]) -> FlipAccuracy:
    """Compare, design by design, changes that were foreseen with those that came, (d, n) each."""
    found = [agreement(guess, truth) for guess, truth in zip(foreseen, exact, strict=True)]
    return FlipAccuracy(
        np.array([each.pearson for each in found]),
        np.array([each.spearman for each in found]),
        np.array([each.recall for each in found]),
        sum(each.count for each in found),
    )


def flip_accuracy(
    network: Predictor | TrainedModel,
    problem: Problem,
    masks: ArrayLike,
    effects: FlipEffects | None = None,
) -> FlipAccuracy:
    """Say how well a network foresees the flips of designs that it should not have seen.

    Parameters
    ----------
    network
        One that has learnt the problem, or several.
    problem
        What the designs are for.
    masks : (d, M) bool
        For example from `held_out_designs`.
    effects
        What the mechanics says of the same designs, where that is known already.

    Raises
    ------
    InvalidModel
        If the network has learnt something else.
    InvalidProblem, InvalidSettings
        As `flip_effects`.
    """
    if isinstance(network, TrainedModel):
        network = Predictor(problem, network)
    truth = flip_effects(problem, masks) if effects is None else effects
    return compare_flips(foreseen_by(network, truth.masks, truth.beams), truth.exact)


def screening_accuracy(effects: FlipEffects) -> FlipAccuracy:
    """Say how well low-rank screening foresees the same flips."""
    return compare_flips(effects.screened, effects.exact)


def held_out_designs(
    data: Dataset, rows: NDArray[np.int64], count: int, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Draw designs at which searches stood, from as many different runs as there are.

    Parameters
    ----------
    rows : int64
        Among which; those held out, if a network is to be judged.
    count
        How many; fewer if there are fewer.

    Returns
    -------
    (d, M) bool

    Raises
    ------
    InvalidDataset
        If no search stood anywhere among the rows.
    """
    stood = rows[data.accepted[rows]]
    if not len(stood):
        raise InvalidDataset("no accepted design among the rows to draw from")
    mixed = rng.permutation(stood)
    order = np.argsort(data.run[mixed], kind="stable")
    runs = data.run[mixed][order]
    turn = np.empty(len(mixed), np.int64)
    turn[order] = np.arange(len(mixed)) - np.searchsorted(runs, runs)
    chosen = np.sort(mixed[np.argsort(turn, kind="stable")[:count]])  # one of each run first
    bits = np.unpackbits(data.packed[chosen], axis=1, count=data.problem.lattice.beam_count)
    return bits.astype(np.bool_)
