"""Predictions of a network for designs of unseen runs, as plain records."""

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
FIRST_SEED = 3_000_000
"""Seed of the first run; the training set of the bundled network has other seeds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """The network, and the runs on which it is tested.

    Parameters
    ----------
    problem
        Bundled problem.
    runs, steps
        Number and length of the searches; every second one maximises the negative efficiency.
    train
        Whether a small network is trained on these runs and tested on a quarter of them.
        Otherwise the bundled network is tested on all of them.
    model, epochs
        Architecture and number of epochs of that training.
    """

    problem: str = "crane"
    runs: int = 24
    steps: int = 582
    train: bool = False
    model: str = "mlp"
    epochs: int = 12


def dataset(settings: Settings) -> Dataset:
    """Return all proposals of searches in both directions."""
    from bellcrank.surrogate.dataset import Dataset

    problem = find_problem(settings.problem)
    packed, efficiency, run_of = [], [], []
    for run in range(settings.runs):
        sign = -1.0 if run % 2 else 1.0
        searched = problem if sign > 0.0 else reverse(problem)
        values = {"search": "paper", "steps": settings.steps, "seed": FIRST_SEED + run}
        search = read_settings({**values, "chains": 1})
        for _, rows in chain_blocks(make_evaluator(searched, search), search, 0):
            converged = rows.status == Status.CONVERGED
            packed.append(rows.mask[converged])
            efficiency.append(sign * rows.efficiency[converged])
            run_of.append(np.full(int(converged.sum()), run))
    return Dataset(problem, np.vstack(packed), np.concatenate(efficiency), np.concatenate(run_of))


def bundled(settings: Settings) -> dict[str, Any]:
    """Predict by the bundled network."""
    from bellcrank.surrogate.predictor import load_model

    data = dataset(settings)
    model: Any = load_model(data.problem)
    with one_thread():
        predicted = model.predict(data.packed)
    return {**_network(model), **_comparison(predicted, data.efficiency)}


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
        predicted = model.predict(data.packed[held_out])
    return {**_network(model), **_comparison(predicted, data.efficiency[held_out])}


def _network(model: Any) -> dict[str, Any]:
    """Return architecture, number of training samples and accuracy per epoch.

    The samples of the network that a training started from count, too.
    """
    start = model.record.get("start") or {}
    before = start.get("designs", 0)
    epochs = [(each["designs"], each["r_squared"]) for each in start.get("epochs", [])]
    epochs += [(each["designs"] + before, each["r_squared"]) for each in model.record["epochs"]]
    return {
        "network": model.architecture,
        "looks": model.record["designs"] + before,
        "epochs": [{"designs": designs, "r_squared": value} for designs, value in epochs],
    }


@contextmanager
def one_thread() -> Iterator[None]:
    """Run PyTorch in one thread, which is faster for small networks."""
    torch = import_torch()
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _comparison(predicted: np.ndarray, actual: np.ndarray) -> dict[str, Any]:
    """Return accuracy, linear fit, and counts on a grid of predicted and actual values."""
    from bellcrank.surrogate.metrics import accuracy

    low = float(min(predicted.min(), actual.min()))
    high = float(max(predicted.max(), actual.max()))
    room = 0.02 * (high - low)
    ends = (low - room, high + room)
    grid, _, _ = np.histogram2d(predicted, actual, bins=BINS, range=(ends, ends))
    slope, offset = np.polyfit(actual, predicted, 1)
    return {
        "accuracy": accuracy(predicted, actual).to_dict(),
        "fit": [float(slope), float(offset)],
        "ends": ends,
        "grid": grid.astype(int).tolist(),
    }
