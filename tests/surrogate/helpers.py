"""Small problems, small data, and what tests compare of networks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.model import Problem, problem_to_dict
from bellcrank.surrogate.dataset import Dataset
from bellcrank.surrogate.recipes import Recipe
from bellcrank.surrogate.trained_model import TrainedModel, architecture_of
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

TINY = Recipe(
    model="mlp", epochs=3, batch=16, epoch_size=80, learning_rate=1e-3, held_out=0.25,
    precision="float32",
)  # fmt: skip
"""Fifteen steps of a network that is quick."""


def beams_present(packed: NDArray[np.uint8], problem: Problem) -> NDArray[np.float64]:
    """Something trivial to learn: how many beams there are, between -1 and 1 or so."""
    beams = problem.lattice.beam_count
    present = np.unpackbits(packed, axis=1, count=beams).sum(axis=1)
    return np.asarray((present - 0.75 * beams) / (0.1 * beams), np.float64)


def random_masks(problem: Problem, count: int, seed: int = 0) -> NDArray[np.bool_]:
    """Designs that lack between none and half of their designable beams."""
    rng = np.random.default_rng(seed)
    masks = np.tile(problem.initial, (count, 1))
    kept = rng.uniform(0.5, 1.0, (count, 1)) > rng.random((count, len(problem.designable)))
    masks[:, problem.designable] = kept
    return masks


def random_dataset(
    problem: Problem,
    runs: int = 8,
    steps: int = 40,
    seed: int = 0,
    label: Callable[[NDArray[np.uint8], Problem], NDArray[np.float64]] = beams_present,
) -> Dataset:
    """Runs of random designs, with a label that needs no mechanics."""
    packed = np.packbits(random_masks(problem, runs * steps, seed), axis=1)
    run, step = np.divmod(np.arange(runs * steps), steps)
    return Dataset(problem, packed, label(packed, problem), run, step, step % 3 == 0)


def equal(first: Dataset, second: Dataset) -> bool:
    """Whether two datasets are the same, to the last bit."""
    columns = ("packed", "efficiency", "run", "step", "accepted")
    return (
        all(np.array_equal(getattr(first, name), getattr(second, name)) for name in columns)
        and first.origin == second.origin
        and problem_to_dict(first.problem) == problem_to_dict(second.problem)
    )


def untrained(problem: Problem, name: str = "mlp", seed: int = 0, **view: Any) -> TrainedModel:
    """A network with random weights, whose predictions differ from design to design."""
    import torch

    architecture = architecture_of(name)
    looks = views[architecture.view](problem, **view)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = architecture.build(looks.shape)
        for each in network.parameters():
            each.data += 0.01 * torch.randn_like(each)
        norms = [each for each in network.modules() if hasattr(each, "momentum")]
        for each in norms:
            each.momentum = 1.0  # one pass sets the running figures: predictions then differ
        packed = np.packbits(random_masks(problem, 8, seed=77), axis=1)
        network.train()(torch.from_numpy(looks.arrays(packed)).float() * looks.scale)
    record = {"note": "untrained"}
    return TrainedModel(
        architecture=name, problem=problem, view=looks, mean=0.25, deviation=0.5,
        network=network.eval(), record=record,
    )  # fmt: skip


def weights(model: TrainedModel) -> dict[str, Any]:
    return {name: value.numpy().copy() for name, value in model.network.state_dict().items()}


def same_weights(first: TrainedModel, second: TrainedModel) -> bool:
    a, b = weights(first), weights(second)
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


def flat_bins(efficiency: NDArray[np.float64], count: int) -> tuple[Any, Any]:
    """Edges of equal bins over the bulk of the efficiencies, and which of them are filled."""
    edges = np.linspace(*np.quantile(efficiency, [1e-4, 1.0 - 1e-4]), count + 1)
    edges[0], edges[-1] = -np.inf, np.inf
    return edges, np.histogram(efficiency, edges)[0] > 0
