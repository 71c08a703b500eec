"""A tiny problem, a tiny dataset of it, and networks trained on that in a second."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.campaign.dataset import reverse
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Input, Output, Problem, Supports, lattices
from bellcrank.search import MetropolisSettings, chain_blocks
from bellcrank.surrogate.dataset import Dataset
from bellcrank.surrogate.recipes import Recipe
from bellcrank.surrogate.training_setup import begin

if TYPE_CHECKING:
    from bellcrank.surrogate.trained_model import TrainedModel

RECIPE = Recipe(model="mlp", epochs=2, batch=64, tested=500, held_out=0.25, precision="float32")
RUNS = 8
STEPS = 250


@cache
def tiny_problem() -> Problem:
    """Five rows of nodes; what is pushed down on the right is to go left on the left."""
    return Problem(
        name="tiny",
        lattice=lattices["triangular-rows"](
            counts=[4, 5, 4, 5, 4], first_x=[0.5, 0.0, 0.5, 0.0, 0.5]
        ),
        supports=Supports(fixed=[0, 1, 2, 3]),
        input=Input(nodes=[21], direction=[0.0, -1.0], drive="displacement", amount=0.2),
        output=Output(nodes=[18], direction=[-1.0, 0.0]),
    )


@cache
def tiny_dataset() -> Dataset:
    """What a few short searches proposed, every second one backwards."""
    problem = tiny_problem()
    packed, efficiency, run = [], [], []
    for number in range(RUNS):
        sign = -1.0 if number % 2 else 1.0
        searched = problem if sign > 0.0 else reverse(problem)
        settings = MetropolisSettings(steps=STEPS, seed=number)
        for _, rows in chain_blocks(SpringEvaluator(searched), settings, 0):
            sound = rows.status == Status.CONVERGED
            packed.append(rows.mask[sound])
            efficiency.append(sign * rows.efficiency[sound])
            run.append(np.full(int(sound.sum()), number))
    return Dataset(problem, np.vstack(packed), np.concatenate(efficiency), np.concatenate(run))


@cache
def tiny_model(seed: int = 0) -> TrainedModel:
    """A perceptron that has seen all that twice."""
    training = begin(tiny_dataset(), Recipe(**{**RECIPE.to_dict(), "seed": seed}), device="cpu")
    for _ in training.run():
        pass
    return training.finish()
