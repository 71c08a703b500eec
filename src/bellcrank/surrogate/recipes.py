"""Recipes: how a network is trained."""

from __future__ import annotations

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
        Designs in an epoch; None for all there are to train with.
    held_out
        Fraction of the runs to test on.
    tested
        Most held-out designs that each epoch is tested on; the end is tested on all.
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
    seed: int = 0
    split_seed: int = 0
    precision: str = "auto"

    def __post_init__(self) -> None:
        _at_least("epochs", self.epochs, 1)
        _at_least("batch", self.batch, 2)
        _at_least("warm_up", self.warm_up, 0)
        _at_least("tested", self.tested, 2)
        _at_least("seed", self.seed, 0)
        _at_least("split_seed", self.split_seed, 0)
        if self.epoch_size is not None:
            _at_least("epoch_size", self.epoch_size, self.batch)
        _one_of("optimiser", self.optimiser, OPTIMISERS)
        _one_of("schedule", self.schedule, SCHEDULES)
        _one_of("precision", self.precision, PRECISIONS)
        if not self.learning_rate > 0.0:
            raise InvalidSettings(f"learning_rate: expected more than 0, got {self.learning_rate}")
        if not self.differences >= 0.0:
            raise InvalidSettings(f"differences: expected at least 0, got {self.differences}")
        if self.differences and self.batch % 2:
            raise InvalidSettings(
                f"batch: expected an even number, since designs come in pairs (differences), "
                f"got {self.batch}"
            )
        if not self.weight_decay >= 0.0:
            raise InvalidSettings(f"weight_decay: expected at least 0, got {self.weight_decay}")
        for name in ("held_out", "averaging"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0 or (name == "held_out" and value == 0.0):
                raise InvalidSettings(f"{name}: expected a fraction below 1, got {value}")

    def to_dict(self) -> dict[str, Any]:
        """Return the recipe as plain data."""
        return asdict(self)

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


def recipe_of(name: str, **changes: Any) -> Recipe:
    """Return a registered recipe, with changes; what is None stays as it is.

    Raises
    ------
    UnknownName, InvalidSettings

    Examples
    --------
    >>> recipe_of("paper", epochs=2).epochs, recipe_of("paper").epochs
    (2, 10)
    """
    return replace(
        recipes[name], **{key: value for key, value in changes.items() if value is not None}
    )
