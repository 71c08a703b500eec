"""How a training begins, in a new folder or in none, and how it is gone on with.

Examples
--------
>>> from bellcrank.surrogate.recipes import recipe_of
>>> training = begin(data, recipe_of("own"), "crane-training")  # doctest: +SKIP
>>> for progress in training.run(): ...  # doctest: +SKIP
>>> model = training.finish()  # doctest: +SKIP
"""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidModel, InvalidSettings
from bellcrank.storage.files import make_folder
from bellcrank.surrogate.backend import find_device, find_precision
from bellcrank.surrogate.checkpoints import restore
from bellcrank.surrogate.folder import (
    CHECKPOINT,
    INITIAL,
    Description,
    check_new,
    data_hash,
    read_description,
    require_data,
    split_hash,
    tidy,
    write_description,
)
from bellcrank.surrogate.identity import architecture_of
from bellcrank.surrogate.splitting import split_by_run
from bellcrank.surrogate.trained import TrainedModel, read_model
from bellcrank.surrogate.training import Training
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    import os

    import torch

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.splitting import Split


def begin(
    data: Dataset,
    recipe: Recipe,
    folder: str | os.PathLike[str] | None = None,
    *,
    device: str = "auto",
    initial: TrainedModel | None = None,
    split: Split | None = None,
    members: int = 1,
) -> Training:
    """Begin a training in a new folder.

    Parameters
    ----------
    initial
        A network to go on from; by default it begins with random weights.
    split
        Rows to learn from, some perhaps more than once, and rows to hold out; by default as the
        recipe says. Whoever resumes has to give the same again.
    members
        Networks of the ensemble that it belongs to, for whoever goes on with that.

    Raises
    ------
    InvalidDataset
        If the data come from a single run.
    InvalidSettings
        If PyTorch or the device is missing, all efficiencies to learn from or to test on are the
        same, or `initial` is of another architecture.
    InvalidModel
        If `initial` numbers beams otherwise.
    UnknownName
        If there is no such model.
    OutputExists
        If a training, or something of one, lies in the folder already.
    """
    if folder is not None:
        check_new(folder)
    where = find_device(device)
    training = _build(data, recipe, where, find_precision(recipe.precision, where), split)
    if initial is not None:
        _go_on_from(training, initial)
    if folder is not None:
        training.folder = Path(folder)
        tidy(training.folder)
        if initial is not None:  # before the description: whoever finds that may go on
            make_folder(training.folder)
            initial.write(training.folder / INITIAL, overwrite=True)
        told = Description(
            recipe, training.precision, data_hash(data), _name_of(split), initial is not None,
            members,
        )  # fmt: skip
        write_description(training.folder, told)
    return training


def resume(
    folder: str | os.PathLike[str],
    data: Dataset,
    *,
    device: str = "auto",
    split: Split | None = None,
) -> Training:
    """Go on with the training in a folder.

    Parameters
    ----------
    split
        As it was begun with.

    Raises
    ------
    InvalidFile
        If there is none, or its description is damaged.
    InvalidSettings
        If it was begun with other data, or another split of them.
    InvalidModel
        If its checkpoint, or the network that it goes on from, is damaged.
    """
    place = Path(folder)
    told = read_description(place)
    require_data(folder, told, data)
    if told.split != _name_of(split):
        raise InvalidSettings(f"{folder}: the training there holds out other designs")
    training = _build(data, told.recipe, find_device(device), told.precision, split)
    training.folder = place
    tidy(place)
    if told.initial:
        _go_on_from(training, read_model(place / INITIAL))
    if (place / CHECKPOINT).exists():
        restore(training, place / CHECKPOINT)
    return training


def _name_of(split: Split | None) -> str | None:
    return None if split is None else split_hash(split)


def _build(
    data: Dataset, recipe: Recipe, device: torch.device, precision: str, given: Split | None
) -> Training:
    """Set up a training with random weights, which is kept nowhere yet."""
    import torch

    from bellcrank.surrogate.feeding import feeder_of

    split = given or split_by_run(data, recipe.held_out, recipe.split_seed)
    seen, held_out = data.efficiency[split.training], data.efficiency[split.held_out]
    if seen.min() == seen.max():  # their deviation may be a remnant of rounding
        raise InvalidSettings(f"all efficiencies are {seen[0]:g}: there is nothing to learn")
    if held_out.min() == held_out.max():
        raise InvalidSettings(
            f"all efficiencies that are held out are {held_out[0]:g}: nothing can be tested with "
            f"them; take more runs, or longer ones"
        )
    architecture = architecture_of(recipe.model)
    view = views[architecture.view](data.problem)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(recipe.seed)
        network = architecture.build(view.shape)
    network = network.to(device).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    model = TrainedModel(
        recipe.model, data.problem, view, float(seen.mean()), float(seen.std()), network=network
    )
    average = copy.deepcopy(network) if recipe.averaging else None
    kind = torch.optim.AdamW if recipe.optimiser == "adamw" else torch.optim.Adam
    optimiser = kind(
        network.parameters(), lr=recipe.learning_rate, weight_decay=recipe.weight_decay
    )
    return Training(
        data, recipe, split, None, device, precision, model, feeder_of(view, device), optimiser,
        average,
    )  # fmt: skip


def _go_on_from(training: Training, model: TrainedModel) -> None:
    """Let a training begin with a trained network's weights, its view and its normalisation."""
    if model.architecture != training.recipe.model:
        raise InvalidSettings(
            f"a {training.recipe.model!r} cannot go on from the weights of a "
            f"{model.architecture!r}; take the recipe that it was trained by, or begin afresh"
        )
    there, here = model.problem, training.data.problem
    if not np.array_equal(there.lattice.beams, here.lattice.beams):
        raise InvalidModel(
            f"the network knows the beams of {there.name!r}, which are not those of "
            f"{here.name!r} in their order"
        )
    training.before = model.seen
    training.look_through(model.view)
    training.model = replace(training.model, mean=model.mean, deviation=model.deviation)
    for network in (training.model.network, training.average):
        if network is not None:
            network.load_state_dict(model.network.state_dict())
