"""Training one network, or several that differ in their seeds, in one folder."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.surrogate.trained import read_model
from bellcrank.surrogate.training import DESCRIPTION, MODEL, Progress, begin, resume

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.trained import TrainedModel
    from bellcrank.surrogate.training import Training

MOST_MEMBERS = 100
PICTURE = "training.png"
DRAWN = 20_000
"""Held-out designs in the picture, at most."""


@dataclass(frozen=True, slots=True)
class FitProgress:
    """Where the training of an ensemble is.

    Parameters
    ----------
    member, members
        The network at hand, from 0, and how many there are.
    progress
        Of that network.
    """

    member: int
    members: int
    progress: Progress


def fit(
    data: Dataset,
    recipe: Recipe | None,
    folder: str | os.PathLike[str],
    *,
    members: int = 1,
    device: str = "auto",
    tell: Callable[[FitProgress], None] = lambda _progress: None,
    stop: Callable[[], bool] = lambda: False,
) -> list[TrainedModel] | None:
    """Train networks, one after the other; go on where a folder has begun ones.

    Parameters
    ----------
    recipe
        For a new training; each member has the next seed. None goes on with what is there.
    folder
        Gets the model, or for several members a folder of each.

    Returns
    -------
    list of TrainedModel or None
        None if it was stopped; what is done is kept.

    Raises
    ------
    InvalidSettings
        If the number of members makes no sense or the data are others.
    OutputExists
        If a training lies in the folder and a recipe was given.
    InvalidFile
        If none lies there and no recipe was given.
    """
    if not 1 <= members <= MOST_MEMBERS:
        raise InvalidSettings(f"members: expected 1 to {MOST_MEMBERS}, got {members}")
    place = Path(folder)
    if recipe is None:
        folders = _begun(place)
    else:
        folders = [place / f"member-{member}" for member in range(members)]
        folders = folders if members > 1 else [place]
        for member, own in enumerate(folders):  # all at once: whoever goes on finds them all
            begin(data, replace(recipe, seed=recipe.seed + member), own, device=device)
    models = []
    for member, own in enumerate(folders):
        if (own / MODEL).exists():
            models.append(read_model(own / MODEL))
            continue
        training = resume(own, data, device=device)
        for progress in training.run(stop):
            tell(FitProgress(member, len(folders), progress))
        if not training.is_done:
            return None
        models.append(training.finish())
        _draw(training, models[-1], own / PICTURE, device)
    return models


def _draw(training: Training, model: TrainedModel, path: Path, device: str) -> None:
    """Draw how well a network has learnt, on some of what was held out."""
    from bellcrank.plots.learning import Learnt, draw_learnt

    record, data = model.record, training.data
    rows = training.split.held_out[:: -(-len(training.split.held_out) // DRAWN)]
    held_out = len(np.unique(data.run[training.split.held_out]))
    learnt = Learnt(
        name=f"{data.problem.name} by {model.architecture}",
        note=f"{record['designs']:,} designs seen, of {data.run_count - held_out:,} runs, in "
        f"{record['seconds'] / 60.0:.0f} minutes; tested on {held_out:,} other runs",
        predicted=model.predict(data.packed[rows], device=device),
        actual=data.efficiency[rows],
        r_squared=record["held_out"]["r_squared"],
        determination=record["held_out"]["determination"],
        designs=np.array([epoch["designs"] for epoch in record["epochs"]], np.float64),
        accuracy=np.array([epoch["r_squared"] for epoch in record["epochs"]]),
    )
    draw_learnt(learnt, path, overwrite=True)


def _begun(place: Path) -> list[Path]:
    """Return the folders of the networks that were begun in a folder."""
    found = sorted(path.parent for path in place.glob(f"member-*/{DESCRIPTION}"))
    if not found and not (place / DESCRIPTION).exists():
        raise InvalidFile(f"{place}: no training to go on with: it has no {DESCRIPTION}")
    return found or [place]


def model_files(path: str | os.PathLike[str]) -> list[Path]:
    """Return the model files that a path stands for: itself, or those in a training's folder.

    Raises
    ------
    InvalidFile
        If it is a folder without any.
    """
    place = Path(path)
    if not place.is_dir():
        return [place]
    if (place / MODEL).exists():
        return [place / MODEL]
    found = sorted(place.glob(f"member-*/{MODEL}"))
    if not found:
        raise InvalidFile(f"{path}: no trained model in this folder; expected {MODEL}")
    return found
