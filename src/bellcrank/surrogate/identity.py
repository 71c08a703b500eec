"""What a trained network is, besides its weights, whatever computes with it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import BellcrankError, InvalidModel
from bellcrank.model import problem_from_dict, problem_to_dict
from bellcrank.surrogate.backend import import_torch
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Lattice, Problem
    from bellcrank.surrogate.models import Architecture
    from bellcrank.surrogate.views import View

MODEL_SCHEMA = "bellcrank/model/1"
METADATA_KEY = "bellcrank"
DIGITS = 6
"""Of positions, in a lattice's hash."""


def lattice_hash(lattice: Lattice) -> str:
    """Return the identity of a lattice: its nodes and beams in their order.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane, other = find_problem("crane"), find_problem("anti-parallel")
    >>> lattice_hash(crane.lattice) == lattice_hash(other.lattice)
    True
    """
    digest = hashlib.sha256()
    digest.update(np.round(lattice.positions, DIGITS).astype("<f8").tobytes())
    digest.update(lattice.beams.astype("<i8").tobytes())
    return digest.hexdigest()[:16]


def architecture_of(name: str) -> Architecture:
    """Return a registered kind of network.

    The registry is imported here and not above: it needs PyTorch, and whoever has none is to
    be told so in a sentence.

    Raises
    ------
    UnknownName
        If there is none of that name.
    InvalidSettings
        If PyTorch is not installed.
    """
    import_torch()
    from bellcrank.surrogate.models import models

    return models[name]


@dataclass(frozen=True, slots=True, eq=False)
class Identity:
    """What a trained network is: what it looks at, what it says, and what for.

    Parameters
    ----------
    architecture
        Name in the registry of models.
    problem
        What it has learnt.
    view
        What it looks at.
    mean, deviation
        Of the efficiencies that it was trained with; the network's output is in units of
        the latter, from the former.
    record
        How it was trained and how well it does, as plain data.
    """

    architecture: str
    problem: Problem
    view: View
    mean: float
    deviation: float
    record: dict[str, Any] = field(default_factory=dict)

    @property
    def looks_at(self) -> str:
        """Name of its view in the registry."""
        return architecture_of(self.architecture).view

    @property
    def seen(self) -> dict[str, float]:
        """Designs that it was trained with and seconds that this took, as its record says.

        Both include what the networks that it went on from had seen and taken.
        """
        before = self.record.get("before", {})
        return {
            name: self.record.get(name, 0) + before.get(name, 0) for name in ("designs", "seconds")
        }

    def efficiencies(self, output: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the efficiencies (n,) that an output (n,) of the network stands for."""
        return self.mean + self.deviation * output

    def describe(self) -> dict[str, Any]:
        """Return all of it as plain data, as the files of models carry it."""
        return {
            "schema": MODEL_SCHEMA,
            "architecture": self.architecture,
            "lattice": lattice_hash(self.problem.lattice),
            "looks_at": self.looks_at,
            "view": self.view.to_dict(),
            "mean": self.mean,
            "deviation": self.deviation,
            "record": self.record,
            "problem": problem_to_dict(self.problem),
        }

    def arguments(self) -> dict[str, Any]:
        """Return its fields by name: what a model is made of, besides its network."""
        return {each.name: getattr(self, each.name) for each in fields(Identity)}


def read_identity(text: str | None, source: str) -> Identity:
    """Read what `Identity.describe` told. Needs no PyTorch.

    Parameters
    ----------
    text
        JSON; None where there was none.
    source
        For messages.

    Raises
    ------
    InvalidModel
        If there is none, or it makes no sense.
    """
    if text is None:
        raise InvalidModel(f"{source}: not a model of bellcrank: it does not say what it is for")
    try:
        told = json.loads(text)
        _check_schema(told["schema"])
        problem = problem_from_dict(told["problem"], source)
        looks_at = told.get("looks_at") or architecture_of(told["architecture"]).view
        view = views[looks_at](problem, **told["view"])
        mean, deviation = float(told["mean"]), float(told["deviation"])
        record = dict(told["record"])
        identity = Identity(told["architecture"], problem, view, mean, deviation, record)
        lattice = told["lattice"]
    except BellcrankError as error:
        raise InvalidModel(f"{source}: {error}") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InvalidModel(f"{source}: what it says about itself is damaged ({error!r})") from None
    if lattice_hash(problem.lattice) != lattice:
        raise InvalidModel(f"{source}: the lattice in it is not the one that it was trained on")
    if not (np.isfinite(mean) and 0.0 < deviation < np.inf):
        raise InvalidModel(f"{source}: mean {mean} and deviation {deviation} make no efficiencies")
    return identity


def _check_schema(name: str) -> None:
    if name != MODEL_SCHEMA:
        raise InvalidModel(f"expected schema {MODEL_SCHEMA!r}, got {name!r}")
