"""From small to large lattices: what a network that has learnt one is worth on another.

Networks over pictures that end in an average over places take pictures of any size, so that the
same weights can look at a larger lattice in two ways: shrunk to the same canvas, where all beams
are shorter, or at the same pixels per lattice unit, on a larger canvas. Asked three ways: as it is,
after going on with few designs of the large lattice, and against a fresh network that has only
those few.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidDataset, InvalidModel, InvalidSettings
from bellcrank.surrogate.beginning import begin
from bellcrank.surrogate.flips import FlipEffects, flip_accuracy, flip_effects, held_out_designs
from bellcrank.surrogate.identity import architecture_of
from bellcrank.surrogate.metrics import Accuracy, accuracy
from bellcrank.surrogate.occlusion import picture_view
from bellcrank.surrogate.recipes import Recipe, recipe_of
from bellcrank.surrogate.splitting import split_by_run
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.flips import FlipAccuracy
    from bellcrank.surrogate.pictures import Canvas
    from bellcrank.surrogate.trained import TrainedModel

FITS = ("canvas", "scale")
"""Ways to look at another lattice: on the same canvas, or at the same scale."""
GENTLER = 0.3
"""Learning rate of going on, over that of beginning."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TransferSettings:
    """What is tried.

    Parameters
    ----------
    fits
        Of `FITS`.
    few
        Numbers of designs of the large lattice to learn from.
    recipe
        Of a fresh network; going on has `GENTLER` times its learning rate. Both make as many
        steps, so give it an `epoch_size`.
    held_out
        Fraction of the runs to test on.
    tested
        Most designs to test on.
    flips
        Held-out designs whose flips are foreseen too; 0 for none.
    seed
        Of all that is drawn.

    Raises
    ------
    InvalidSettings
    """

    fits: tuple[str, ...] = FITS
    few: tuple[int, ...] = (300, 1000, 3000)
    recipe: Recipe = field(
        default_factory=lambda: recipe_of("own", epochs=2, epoch_size=16_384, warm_up=50)
    )
    held_out: float = 0.25
    tested: int = 5000
    flips: int = 10
    seed: int = 0

    def __post_init__(self) -> None:
        for name in self.fits:
            if name not in FITS:
                raise InvalidSettings(f"fits: expected some of {', '.join(FITS)}, got {name!r}")
        for count in self.few:
            if count < self.recipe.batch:
                raise InvalidSettings(
                    f"few: expected at least a batch of {self.recipe.batch} designs, got {count}"
                )


@dataclass(frozen=True, slots=True)
class Trial:
    """One network on the large lattice.

    Parameters
    ----------
    fit
        How it looks at the lattice.
    how
        ``as it is``, ``going on`` or ``afresh``.
    designs
        Of the large lattice that it has learnt from.
    accuracy
        On held-out runs of the large lattice.
    flips
        How well it foresees the flips of some designs there; None if that was not asked.
    """

    fit: str
    how: str
    designs: int
    accuracy: Accuracy
    flips: FlipAccuracy | None

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data, with Pearson's correlation of the predictions."""
        return {
            "fit": self.fit,
            "how": self.how,
            "designs": self.designs,
            "correlation": math.sqrt(self.accuracy.r_squared),
            **asdict(self.accuracy),
            "flips": None if self.flips is None else self.flips.to_dict(),
        }


def carry_over(model: TrainedModel, problem: Problem, fit: str = "canvas") -> TrainedModel:
    """Return a network with the same weights that looks at another problem's lattice.

    Parameters
    ----------
    model
        Over pictures.
    problem
        Of whatever size.
    fit
        ``canvas``: drawn as large as fits the canvas that it knows. ``scale``: with as many pixels
        per lattice unit, on a canvas that is larger or smaller by as much.

    Raises
    ------
    InvalidSettings
        If the network looks at no pictures, there is no such fit, or the canvas would be too large.
    InvalidModel
        If its weights depend on the size of the pictures.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.surrogate.models import models
    >>> from bellcrank.surrogate.trained import TrainedModel
    >>> small, large = find_problem("scaling-8"), find_problem("scaling-12")
    >>> view = views["picture"](small)
    >>> network = models["resnet18-w16"].build(view.shape)
    >>> model = TrainedModel("resnet18-w16", small, view, 0.0, 1.0, network=network)
    >>> carry_over(model, large, "canvas").view.shape
    (1, 128, 192)
    >>> carry_over(model, large, "scale").view.shape
    (1, 182, 273)
    """
    canvas = picture_view(model).renderer.canvas
    if fit not in FITS:
        raise InvalidSettings(f"fit: expected one of {', '.join(FITS)}, got {fit!r}")
    if fit == "scale":
        canvas = _canvas_to_scale(canvas, model.problem, problem)
    architecture = architecture_of(model.architecture)
    view = views[architecture.view](problem, **canvas.to_dict())
    network = architecture.build(view.shape)
    try:
        network.load_state_dict(model.network.state_dict())
    except RuntimeError:
        raise InvalidModel(
            f"{model.architecture!r}: its weights depend on the size of the pictures, so that it "
            f"cannot look at others"
        ) from None
    return replace(model, problem=problem, view=view, network=network.eval(), record={})


def _canvas_to_scale(canvas: Canvas, known: Problem, other: Problem) -> Canvas:
    """Return a canvas of the same proportions where the other lattice has the known scale."""
    from bellcrank.surrogate.pictures import Canvas as Sheet

    there = np.ptp(known.lattice.positions, axis=0)
    scale = float((np.ptp(canvas.place(known.lattice.positions), axis=0) / there).max())
    wanted = scale * np.ptp(other.lattice.positions, axis=0) + canvas.border
    times = float((wanted / [canvas.width, canvas.height]).max())
    grown = replace(canvas, width=round(times * canvas.width), height=round(times * canvas.height))
    return Sheet(**grown.to_dict())


def try_transfer(
    source: TrainedModel,
    data: Dataset,
    settings: TransferSettings | None = None,
    *,
    device: str = "auto",
) -> Iterator[Trial]:
    """Try a network on a lattice that it has not learnt; yields one trial after the other.

    Parameters
    ----------
    source
        Over pictures, trained on the small lattice.
    data
        Of the large one. A part of its runs is held out of everything.
    settings
        What is tried.
    device
        Where networks learn.

    Raises
    ------
    InvalidSettings, InvalidModel
        As `carry_over`.
    InvalidDataset
        If there are too few designs or runs.
    """
    chosen = settings or TransferSettings()
    split = split_by_run(data, chosen.held_out, chosen.seed)
    rng = np.random.default_rng(np.random.SeedSequence(chosen.seed, spawn_key=(0,)))
    if len(split.training) < max(chosen.few, default=0):
        raise InvalidDataset(
            f"few: {max(chosen.few)} designs are wanted, but outside the held-out runs there are "
            f"{len(split.training)}"
        )
    tested = rng.permutation(split.held_out)[: chosen.tested]
    order = rng.permutation(split.training)
    effects = None
    if chosen.flips:
        masks = held_out_designs(data, split.held_out, chosen.flips, rng)
        effects = flip_effects(data.problem, masks)
    for fit in chosen.fits:
        carried = carry_over(source, data.problem, fit)
        yield _judge(carried, data, tested, effects, (fit, "as it is", 0), device)
        for count in chosen.few:
            known = data.take(np.sort(order[:count]))
            for how in ("going on", "afresh"):
                learnt = _learn(carried, known, chosen.recipe, how == "going on", device)
                yield _judge(learnt, data, tested, effects, (fit, how, count), device)


def _learn(
    carried: TrainedModel, known: Dataset, recipe: Recipe, going_on: bool, device: str
) -> TrainedModel:
    """Train with few designs, from the weights that are there or from fresh ones."""
    recipe = replace(recipe, model=carried.architecture)
    if going_on:
        recipe = replace(recipe, learning_rate=GENTLER * recipe.learning_rate)
    training = begin(known, recipe, device=device, initial=carried if going_on else None)
    training.look_through(carried.view)
    for _ in training.run():
        pass
    return training.finish()


def _judge(
    model: TrainedModel,
    data: Dataset,
    rows: NDArray[np.int64],
    effects: FlipEffects | None,
    named: tuple[str, str, int],
    device: str,
) -> Trial:
    found = accuracy(model.predict(data.packed[rows], device=device), data.efficiency[rows])
    flips = None
    if effects is not None:
        flips = flip_accuracy(model, data.problem, effects.masks, effects)
    return Trial(*named, found, flips)
