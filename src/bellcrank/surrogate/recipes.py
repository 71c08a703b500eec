"""Recipes: settings of a training."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry

PRECISIONS = ("auto", "float32", "bfloat16")
CHOICES = {
    "optimiser": ("adam", "adamw"),
    "schedule": ("constant", "cosine"),
    "precision": PRECISIONS,
}
LEAST = {"epochs": 1, "batch": 2, "warm_up": 0, "tested": 2, "seed": 0, "split_seed": 0}
"""Smallest values of whole numbers."""
RANGES = {
    "learning_rate": ("above 0", math.ulp(0.0), math.inf),
    "weight_decay": ("at least 0", 0.0, math.inf),
    "held_out": ("above 0 and below 1", math.ulp(0.0), 1.0),
    "averaging": ("at least 0 and below 1", 0.0, 1.0),
}
"""Range of each real number, in text and as a half-open interval."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """Settings of a training; the defaults are the paper's.

    Parameters
    ----------
    model
        Name in the registry of models.
    epochs
        Number of epochs.
    batch
        Designs in each step of the optimiser.
    optimiser
        ``adam`` or ``adamw`` (with `weight_decay`).
    learning_rate, schedule, warm_up
        Largest learning rate; ``constant``, or decreasing to 0 along a ``cosine``; steps of
        linear increase from 0.
    weight_decay
        Weight decay of ``adamw``.
    resampling
        Draw designs with replacement so that efficiencies are distributed uniformly.
    averaging
        Decay per step of an exponential moving average of the weights, which becomes the result;
        0 for no average.
    epoch_size
        Designs in an epoch; None for the size of the training set. A shorter epoch continues
        where the last one ended.
    held_out
        Fraction of the runs held out for tests.
    tested
        Largest number of held-out designs in the test after each epoch.
    tested_last
        Largest number in the final test; None for all.
    seed
        Seed of the initial weights and the order of the designs.
    split_seed
        Seed of the choice of held-out runs.
    precision
        Arithmetic of the network: ``float32``, ``bfloat16``, or ``auto``, which is bfloat16 where
        the hardware supports it.

    Raises
    ------
    InvalidSettings

    References
    ----------
    S. Bonfanti et al., Nat. Commun. 11, 4162 (2020), Methods, for the defaults.
    """

    model: str = "resnet50"
    epochs: int = 10
    batch: int = 32
    optimiser: str = "adam"
    learning_rate: float = 1e-3
    schedule: str = "constant"
    warm_up: int = 0
    weight_decay: float = 0.0
    resampling: bool = True
    averaging: float = 0.0
    epoch_size: int | None = None
    held_out: float = 0.25
    tested: int = 20_000
    tested_last: int | None = None
    seed: int = 0
    split_seed: int = 0
    precision: str = "auto"

    def __post_init__(self) -> None:
        for name, least in LEAST.items():
            _check_whole(name, getattr(self, name), least)
        if self.tested_last is not None:
            _check_whole("tested_last", self.tested_last, LEAST["tested"])
        if self.epoch_size is not None:
            _check_whole("epoch_size", self.epoch_size, self.batch)
        for name, (label, low, high) in RANGES.items():
            value = getattr(self, name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or not low <= value < high:
                raise InvalidSettings(f"{name}: expected a number {label}, got {value!r}")
        for name, known in CHOICES.items():
            if (value := getattr(self, name)) not in known:
                raise InvalidSettings(f"{name}: expected one of {', '.join(known)}, got {value!r}")
        if not isinstance(self.resampling, bool):
            raise InvalidSettings(f"resampling: expected true or false, got {self.resampling!r}")

    def to_dict(self) -> dict[str, Any]:
        """Return the recipe as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild a recipe from plain data.

        Raises
        ------
        InvalidSettings
            If a key is unknown or a value is invalid.
        """
        known = {each.name for each in fields(cls)}
        if unknown := sorted(set(data) - known):
            raise InvalidSettings(
                f"{unknown[0]}: unknown key of a recipe; expected one of {', '.join(sorted(known))}"
            )
        return cls(**data)


def _check_whole(name: str, value: object, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InvalidSettings(f"{name}: expected a whole number of at least {least}, got {value!r}")


recipes: Registry[Recipe] = Registry("recipe")
recipes.register("paper")(Recipe())
recipes.register("own")(
    Recipe(
        model="resnet18-w16",
        epochs=3,
        batch=64,
        optimiser="adamw",
        learning_rate=3e-3,
        schedule="cosine",
        warm_up=500,
        weight_decay=0.01,
        resampling=False,
        averaging=0.999,
    )
)


def recipe_of(name: str, /, **changes: Any) -> Recipe:
    """Return a registered recipe with changes; a change to None is ignored.

    Raises
    ------
    UnknownName, InvalidSettings

    Examples
    --------
    >>> recipe_of("paper", epochs=2).epochs, recipe_of("paper").epochs
    (2, 10)
    """
    given = {key: value for key, value in changes.items() if value is not None}
    return Recipe.from_dict({**recipes[name].to_dict(), **given})
