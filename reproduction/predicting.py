"""Networks and what they predict of runs that they have not seen, as plain records."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.campaign.dataset import reverse
from bellcrank.mechanics import Status
from bellcrank.model import find_problem
from bellcrank.search import chain_blocks, make_evaluator, read_settings
from bellcrank.surrogate.backend import import_torch

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.surrogate.dataset import Dataset

BINS = 64
FIRST = 3_000_000
"""Seed of the runs that the network which comes along is tested with: it has learnt from others."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """A network, and what it is tested with.

    Parameters
    ----------
    runs, steps
        Searches whose proposals are predicted, half of them backwards.
    train
        Whether a small network is trained on them first, and tested on a quarter of the runs;
        else the one that comes along predicts all of them.
    model, epochs
        Of that training.
    """

    problem: str = "crane"
    runs: int = 24
    steps: int = 582
    train: bool = False
    model: str = "mlp"
    epochs: int = 12


def dataset(settings: Settings) -> Dataset:
    """Return all that searches there and back proposed."""
    from bellcrank.surrogate.dataset import Dataset

    problem = find_problem(settings.problem)
    packed, efficiency, run_of = [], [], []
    for number_of in range(settings.runs):
        sign = -1.0 if number_of % 2 else 1.0
        searched = problem if sign > 0.0 else reverse(problem)
        told = {"search": "paper", "steps": settings.steps, "seed": FIRST + number_of}
        search = read_settings({**told, "chains": 1})
        for _, rows in chain_blocks(make_evaluator(searched, search), search, 0):
            sound = rows.status == Status.CONVERGED
            packed.append(rows.mask[sound])
            efficiency.append(sign * rows.efficiency[sound])
            run_of.append(np.full(int(sound.sum()), number_of))
    return Dataset(problem, np.vstack(packed), np.concatenate(efficiency), np.concatenate(run_of))


def shipped(settings: Settings) -> dict[str, Any]:
    """Predict with the network that comes along."""
    from bellcrank.surrogate.predictor import load_model

    data = dataset(settings)
    model: Any = load_model(data.problem)
    with one_thread():
        predicted = model.predict(data.packed)
    told = _tested(predicted, data.efficiency)
    epochs = [
        {"designs": each["designs"], "r_squared": each["r_squared"]}
        for each in model.record["epochs"]
    ]
    before = model.record.get("before", {}).get("designs", 0)
    return {
        "network": model.architecture,
        "looks": model.record["designs"],
        "epochs": [{**each, "designs": each["designs"] + before} for each in epochs],
        "held_out_by_its_record": model.record["held_out"],
        **told,
    }


def trained(settings: Settings) -> dict[str, Any]:
    """Train a small network on most of the runs, and predict the others."""
    from bellcrank.surrogate.recipes import recipe_of
    from bellcrank.surrogate.training_setup import begin

    data = dataset(settings)
    recipe = recipe_of("own", model=settings.model, epochs=settings.epochs, precision="float32")
    with one_thread():
        training = begin(data, recipe, device="cpu")
        for _ in training.run():
            pass
        model = training.finish()
    held_out = training.split.held_out
    told = _tested(model.predict(data.packed[held_out]), data.efficiency[held_out])
    epochs = [
        {"designs": each["designs"], "r_squared": each["r_squared"]}
        for each in model.record["epochs"]
    ]
    return {
        "network": model.architecture,
        "looks": model.record["designs"],
        "epochs": epochs,
        **told,
    }


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep small networks from waiting for threads."""
    torch = import_torch()
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _tested(predicted: np.ndarray, actual: np.ndarray) -> dict[str, Any]:
    """Return how predictions agree, as figures and as counts on a grid."""
    from bellcrank.surrogate.metrics import accuracy

    low = float(min(predicted.min(), actual.min()))
    high = float(max(predicted.max(), actual.max()))
    room = 0.02 * (high - low)
    ends = (low - room, high + room)
    grid, _, _ = np.histogram2d(predicted, actual, bins=BINS, range=(ends, ends))
    slope, offset = np.polyfit(actual, predicted, 1)
    both = [np.histogram(values, bins=BINS, range=ends)[0] for values in (actual, predicted)]
    return {
        "accuracy": accuracy(predicted, actual).to_dict(),
        "fit": [float(slope), float(offset)],
        "ends": ends,
        "grid": grid.astype(int).tolist(),
        "spread": {"mechanics": both[0].tolist(), "network": both[1].tolist()},
    }
