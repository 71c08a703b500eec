"""Start and resumption of a training, from random weights or from those of a trained network.

Examples
--------
>>> from bellcrank.surrogate.recipes import recipe_of
>>> training = begin(data, recipe_of("own"), "crane-training")  # doctest: +SKIP
>>> for progress in training.run(): ...  # doctest: +SKIP
>>> model = training.finish()  # doctest: +SKIP
"""

from __future__ import annotations

import copy
import hashlib
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidModel, InvalidSettings, OutputExists
from bellcrank.provenance import provenance
from bellcrank.storage.description import Description, read_description, write_description
from bellcrank.storage.files import make_folder, remove_temporaries
from bellcrank.surrogate.backend import find_device, find_precision
from bellcrank.surrogate.checkpoints import CHECKPOINT, TrainingTensors
from bellcrank.surrogate.matching import require_same_problem
from bellcrank.surrogate.recipes import Recipe
from bellcrank.surrogate.splitting import split_by_run
from bellcrank.surrogate.trained_model import MODEL, TrainedModel, architecture_of, read_model
from bellcrank.surrogate.training import Training
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    import os

    import torch
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset

TRAINING_SCHEMA = "bellcrank/training/4"
DESCRIPTION = "training.json"
KEYS = ("recipe", "precision", "data", "started")
"""Keys of the description of a training."""
START = "start.safetensors"
"""Name of the file with the network whose weights a training started from."""
_FILES = re.compile("|".join(map(re.escape, (DESCRIPTION, CHECKPOINT, MODEL, START))))


def begin(
    data: Dataset,
    recipe: Recipe,
    folder: str | os.PathLike[str] | None = None,
    *,
    start: TrainedModel | None = None,
    device: str = "auto",
) -> Training:
    """Start a training.

    Parameters
    ----------
    folder
        New folder for its files; None to write nothing.
    start
        Trained network whose weights, normalisation and view are the first ones; it is not changed.
        None for random weights.

    Raises
    ------
    InvalidDataset
        If the data come from a single run.
    InvalidSettings
        If PyTorch or the device is not available, or all training or all held-out efficiencies
        are equal.
    UnknownName
        If there is no such model.
    InvalidModel
        If `start` has another architecture than the recipe, or was trained on another problem.
    OutputExists
        If the folder contains files of a training.
    """
    if folder is not None:
        for name in (DESCRIPTION, CHECKPOINT, MODEL, START):
            if (Path(folder) / name).exists():
                raise OutputExists(
                    f"{Path(folder) / name}: this folder contains a training; resume it "
                    f"(--resume), or choose another folder (--out)"
                )
    where = find_device(device)
    training = _build(data, recipe, where, find_precision(recipe.precision, where), start)
    if folder is not None:
        training.folder = Path(folder)
        make_folder(training.folder)
        remove_temporaries(training.folder, _FILES)
        content = {
            "recipe": recipe.to_dict(),
            "precision": training.precision,
            "data": data_hash(data),
            "started": start is not None,
        }
        if start is not None:
            start.write(training.folder / START)
        write_description(
            training.folder / DESCRIPTION, TRAINING_SCHEMA, Description(content, provenance())
        )
    return training


def resume(folder: str | os.PathLike[str], data: Dataset, *, device: str = "auto") -> Training:
    """Resume the training in a folder.

    Raises
    ------
    InvalidFile
        If there is none.
    CorruptRun
        If its description is damaged.
    InvalidSettings
        If it was started with other data.
    InvalidModel
        If its checkpoint, or the network that it started from, is damaged.
    """
    path = Path(folder)
    content = read_description(path / DESCRIPTION, TRAINING_SCHEMA, "training", KEYS).content
    if content["data"] != data_hash(data):
        raise InvalidSettings(f"{folder}: the training there was started with other data")
    recipe = Recipe.from_dict(content["recipe"])
    start = read_model(path / START) if content["started"] else None
    training = _build(data, recipe, find_device(device), content["precision"], start)
    training.folder = path
    remove_temporaries(path, _FILES)
    if (path / CHECKPOINT).exists():
        training.restore(path / CHECKPOINT)
    return training


def data_hash(data: Dataset) -> str:
    """Return a hash of the masks, efficiencies and runs of a dataset."""
    digest = hashlib.sha256()
    for column in (data.packed, data.efficiency, data.run):
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()[:16]


def _build(
    data: Dataset, recipe: Recipe, device: torch.device, precision: str, start: TrainedModel | None
) -> Training:
    """Set up a training without a folder."""
    import torch

    split = split_by_run(data, recipe.held_out, recipe.split_seed)
    seen, held_out = data.efficiency[split.training], data.efficiency[split.held_out]
    if seen.min() == seen.max():  # their deviation may be rounding noise
        raise InvalidSettings(
            f"all training efficiencies are {seen[0]:g}: a network cannot be trained on them"
        )
    if held_out.min() == held_out.max():
        raise InvalidSettings(
            f"all held-out efficiencies are {held_out[0]:g}: a network cannot be tested on them; "
            f"use more or longer runs"
        )
    if start is None:
        model = _untrained(data.problem, recipe, seen)
    else:
        model = _copy(start, data.problem, recipe)
    network = model.network.to(device).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    model = replace(model, network=network)
    average = copy.deepcopy(network) if recipe.averaging else None
    kind = torch.optim.AdamW if recipe.optimiser == "adamw" else torch.optim.Adam
    optimiser = kind(
        network.parameters(), lr=recipe.learning_rate, weight_decay=recipe.weight_decay
    )
    return Training(
        data, recipe, split, None, device, precision, model,
        TrainingTensors(network, optimiser, average),
        start=None if start is None else start.record,
    )  # fmt: skip


def _untrained(problem: Problem, recipe: Recipe, efficiency: NDArray[np.float64]) -> TrainedModel:
    """Return a network with random weights, normalised by the efficiencies (n,) of its training."""
    import torch

    architecture = architecture_of(recipe.model)
    view = views[architecture.view](problem)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(recipe.seed)
        network = architecture.build(view.shape)
    return TrainedModel(
        architecture=recipe.model, problem=problem, view=view, mean=float(efficiency.mean()),
        deviation=float(efficiency.std()), network=network,
    )  # fmt: skip


def _copy(start: TrainedModel, problem: Problem, recipe: Recipe) -> TrainedModel:
    """Return a copy of a trained network for a training by a recipe."""
    if start.architecture != recipe.model:
        raise InvalidModel(
            f"the training starts from a {start.architecture!r}, but its recipe has the model "
            f"{recipe.model!r}; choose the same model (--model {start.architecture})"
        )
    require_same_problem(start.problem, problem)
    network = architecture_of(start.architecture).build(start.view.shape)
    network.load_state_dict(start.network.state_dict())
    return replace(start, problem=problem, network=network, record={})
