"""What a recipe says of each step: which rows, at what rate, and how the average follows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.surrogate.splitting import flattening_chances

if TYPE_CHECKING:
    import torch
    from numpy.typing import NDArray

    from bellcrank.surrogate.recipes import Recipe


def rows_of_epoch(
    recipe: Recipe,
    epoch: int,
    rows: NDArray[np.int64],
    efficiency: NDArray[np.float64],
    wanted: int,
    neighbour: NDArray[np.int64] | None = None,
) -> NDArray[np.int64]:
    """Return the rows of an epoch, in the order in which they are seen.

    Without resampling, epochs go through the rows in a random order, each where the last one
    left off, and through all of them before any comes again.

    Parameters
    ----------
    epoch
        From 0. With the recipe's seed it names the stream of random numbers.
    rows
        To train with.
    efficiency
        Of these rows.
    wanted
        How many.
    neighbour
        Of every row of the data, the one to show after it; None for no pairs.

    Examples
    --------
    >>> from bellcrank.surrogate.recipes import Recipe
    >>> plain = Recipe(resampling=False)
    >>> halves = [rows_of_epoch(plain, epoch, np.arange(4), np.zeros(4), 2) for epoch in (0, 1)]
    >>> sorted(np.concatenate(halves).tolist())
    [0, 1, 2, 3]
    """
    if neighbour is not None:
        first = rows_of_epoch(recipe, epoch, rows, efficiency, wanted // 2)
        return np.stack([first, neighbour[first]], axis=1).ravel()

    def stream(number: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(recipe.seed, spawn_key=(number,)))

    if recipe.resampling:
        return np.asarray(stream(epoch).choice(rows, wanted, p=flattening_chances(efficiency)))
    start, stop = epoch * wanted, (epoch + 1) * wanted
    begun, ended = start // len(rows), (stop - 1) // len(rows)
    passes = np.concatenate([stream(each).permutation(rows) for each in range(begun, ended + 1)])
    return passes[start - begun * len(rows) :][:wanted]


def neighbours_of(run: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for each row the one before it in its run; for the first of a run the one after.

    Parameters
    ----------
    run : (n,)
        Of each row; rows of a run stand together.

    Examples
    --------
    >>> neighbours_of(np.array([0, 0, 0, 1, 2, 2])).tolist()
    [1, 0, 1, 3, 5, 4]
    """
    rows = np.arange(len(run))
    same = np.append(run[1:] == run[:-1], False)
    follows = np.insert(same[:-1], 0, False)
    return np.where(follows, rows - 1, np.where(same, rows + 1, rows))


def rate_of(recipe: Recipe, step: int, total: int) -> float:
    """Return the learning rate of a step, from 0, of so many in all.

    Examples
    --------
    >>> from bellcrank.surrogate.recipes import Recipe
    >>> recipe = Recipe(learning_rate=0.1, warm_up=10, schedule="cosine")
    >>> [round(rate_of(recipe, step, 100), 4) for step in (0, 9, 50, 100)]
    [0.01, 0.098, 0.05, 0.0]
    """
    rate = recipe.learning_rate
    if recipe.warm_up:
        rate *= min(1.0, (step + 1) / recipe.warm_up)
    if recipe.schedule == "cosine":
        rate *= 0.5 + 0.5 * math.cos(math.pi * step / total)
    return rate


def move_average(
    average: torch.nn.Module, network: torch.nn.Module, decay: float, step: int
) -> None:
    """Move the running average of weights towards the network, faster at first."""
    import torch

    weight = 1.0 - min(decay, (1.0 + step) / (10.0 + step))
    with torch.no_grad():
        mine, theirs = average.state_dict(), network.state_dict()
        moving = [name for name, value in mine.items() if value.is_floating_point()]
        torch._foreach_lerp_([mine[n] for n in moving], [theirs[n] for n in moving], weight)
        for name, value in mine.items():
            if not value.is_floating_point():
                value.copy_(theirs[name])
