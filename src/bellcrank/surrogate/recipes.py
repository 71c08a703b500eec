"""Recipes: how a network is trained."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Self

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry

OPTIMISERS = ("adam", "adamw")
SCHEDULES = ("constant", "cosine")
PRECISIONS = ("auto", "float32", "bfloat16")


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """How a network is trained; the defaults are the paper's.

    Parameters
    ----------
    model
        Name in the registry of models.
    epochs
        Times that as many designs are seen as there are to train with, or `epoch_size`.
    batch
        Designs between two changes of the weights.
    optimiser
        ``adam``, or ``adamw``, which forgets by `weight_decay`.
    learning_rate, schedule, warm_up
        Highest rate; ``constant``, or falling to nothing along a ``cosine``; steps over which
        it rises from nothing.
    weight_decay
        Of ``adamw``.
    differences
        Weight of the error in the differences between designs that a run proposed one after
        the other, which a flip or two tell apart; 0 leaves it out. Half of the designs of a
        batch are then the neighbours of the other half.
    resampling
        Whether designs are drawn, with replacement, so that efficiencies are seen equally often.
    averaging
        Decay, a step, of the running average of the weights that is kept in the end; 0 keeps
        the last weights themselves.
    epoch_size
        Designs in an epoch; None for all there are to train with. An epoch of fewer goes on
        where the last one left off.
    held_out
        Fraction of the runs to test on.
    tested
        Most held-out designs that each epoch is tested on, and each round of learning from its
        own searches.
    tested_last
        Most that the end of a training is tested on; None for all.
    seed
        Of the initial weights and of the order of designs.
    split_seed
        Of what is held out.
    precision
        Of the arithmetic inside the network: ``auto`` takes bfloat16 where it is fast.

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
    differences: float = 0.0
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
        _at_least("epochs", self.epochs, 1)
        _at_least("batch", self.batch, 2)
        _at_least("warm_up", self.warm_up, 0)
        _at_least("tested", self.tested, 2)
        if self.tested_last is not None:
            _at_least("tested_last", self.tested_last, 2)
        _at_least("seed", self.seed, 0)
        _at_least("split_seed", self.split_seed, 0)
        if self.epoch_size is not None:
            _at_least("epoch_size", self.epoch_size, self.batch)
        _one_of("optimiser", self.optimiser, OPTIMISERS)
        _one_of("schedule", self.schedule, SCHEDULES)
        _one_of("precision", self.precision, PRECISIONS)
        for name, least, below in _RANGES:
            _in_range(name, getattr(self, name), least, below)
        if not isinstance(self.resampling, bool):
            raise InvalidSettings(f"resampling: expected true or false, got {self.resampling!r}")
        if self.differences and self.batch % 2:
            raise InvalidSettings(
                f"batch: expected an even number, since designs come in pairs (differences), "
                f"got {self.batch}"
            )

    def to_dict(self) -> dict[str, Any]:
        """Return the recipe as plain data."""
        return asdict(self)

    def of_member(self, member: int) -> Self:
        """Return the recipe of a network of several, from 0: each has the next seed."""
        return replace(self, seed=self.seed + member)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild a recipe.

        Raises
        ------
        InvalidSettings
            If it has keys that recipes have not.
        """
        known = {each.name for each in fields(cls)}
        if unknown := sorted(set(data) - known):
            raise InvalidSettings(
                f"{unknown[0]}: no such key in a recipe; it has: {', '.join(sorted(known))}"
            )
        return cls(**data)


_TINY = 1e-300
"""The least number above nothing that is worth telling from it."""
_RANGES = (
    ("learning_rate", _TINY, math.inf),
    ("weight_decay", 0.0, math.inf),
    ("differences", 0.0, math.inf),
    ("held_out", _TINY, 1.0),
    ("averaging", 0.0, 1.0),
)
"""Figures of a recipe, with the least that they may be and what they must stay below."""


def _in_range(name: str, value: float, least: float, below: float) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not least <= value < below:
        low = "at least 0" if least == 0.0 else "above 0"
        high = "" if below == math.inf else f" and below {below:g}"
        raise InvalidSettings(f"{name}: expected a number {low}{high}, got {value!r}")


def _at_least(name: str, value: int, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InvalidSettings(f"{name}: expected a whole number of at least {least}, got {value!r}")


def _one_of(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise InvalidSettings(f"{name}: expected one of {', '.join(known)}, got {value!r}")


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
    """Return a registered recipe, with changes; what is None stays as it is.

    Raises
    ------
    UnknownName, InvalidSettings

    Examples
    --------
    >>> recipe_of("paper", epochs=2).epochs, recipe_of("paper").epochs
    (2, 10)
    """
    told = {key: value for key, value in changes.items() if value is not None}
    return Recipe.from_dict({**recipes[name].to_dict(), **told})
