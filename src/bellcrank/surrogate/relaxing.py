"""Beams that are there in part: what a network says between designs, and how fast that changes.

A network gets numbers, and nothing keeps them from those that no design has. A beam that is
there to the part b lays b times its ink, so that a picture is ``1 - prod (1 - b * coverage)``:
the picture of a design where all b are 0 or 1, and differentiable everywhere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry
from bellcrank.surrogate.backend import find_device, import_torch

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.surrogate.trained import TrainedModel
    from bellcrank.surrogate.views import BitsView, PictureView


class Relaxation(Protocol):
    """A view of designs whose beams may be there in part."""

    def see(self, presence: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what a network gets, of the shape of its input, for presence (M,)."""

    def trace_back(
        self, presence: NDArray[np.float64], slope: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Turn a derivative with respect to the input into one with respect to presence (M,)."""


relaxations: Registry[Callable[[Any], Relaxation]] = Registry("relaxation of a view")
"""By the name of the view."""


@relaxations.register("picture")
class RelaxedPicture:
    """Pictures of beams that lay a part of their ink."""

    def __init__(self, view: PictureView) -> None:
        start, pixel, passed = view.renderer.strokes
        self.shape = view.shape
        self.beams = len(start) - 1
        self.beam = np.repeat(np.arange(self.beams), np.diff(start))
        self.pixel = pixel.astype(np.int64)
        self.coverage = 1.0 - passed.astype(np.float64)

    def see(self, presence: NDArray[np.float64]) -> NDArray[np.float64]:
        """Draw one picture."""
        passed = np.ones(int(np.prod(self.shape)))
        np.multiply.at(passed, self.pixel, 1.0 - presence[self.beam] * self.coverage)
        return np.asarray((1.0 - passed).reshape(self.shape))

    def trace_back(
        self, presence: NDArray[np.float64], slope: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Ask each pixel of each beam what all other beams let through there."""
        factor = 1.0 - presence[self.beam] * self.coverage
        opaque = factor == 0.0
        passed = np.ones(slope.size)
        np.multiply.at(passed, self.pixel, np.where(opaque, 1.0, factor))
        opaque_there = np.bincount(self.pixel, opaque, slope.size)[self.pixel]
        others = np.where(
            opaque_there == opaque,  # no other beam covers all of the pixel
            passed[self.pixel] / np.where(opaque, 1.0, factor),
            0.0,
        )
        parts = slope.ravel()[self.pixel] * self.coverage * others
        return np.bincount(self.beam, parts, self.beams).astype(np.float64)


@relaxations.register("bits")
class RelaxedBits:
    """Bits between 0 and 1."""

    def __init__(self, view: BitsView) -> None:
        del view

    def see(self, presence: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the presence itself."""
        return presence

    def trace_back(
        self, presence: NDArray[np.float64], slope: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the slope itself."""
        del presence
        return slope


def value_and_gradient(
    model: TrainedModel, presence: ArrayLike, *, device: str = "auto"
) -> tuple[float, NDArray[np.float64]]:
    """Return the efficiency that a network predicts, and its derivative by each beam's presence.

    Parameters
    ----------
    model
        Computes in the precision of its own weights.
    presence : (M,)
        How much of each beam of the model's problem is there, from 0 to 1.
    device
        As `bellcrank.surrogate.backend` has them.

    Returns
    -------
    float
        Of a design, the same as `TrainedModel.predict`, except that pictures are not rounded to
        256 greys here.
    (M,) float64

    Raises
    ------
    InvalidSettings
        If a presence is not between 0 and 1.
    UnknownName
        If it is not known how the network's view could show parts of beams.

    Examples
    --------
    >>> import torch
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.surrogate.models import models
    >>> from bellcrank.surrogate.trained import TrainedModel
    >>> from bellcrank.surrogate.views import views
    >>> crane = find_problem("crane")
    >>> view = views["bits"](crane)
    >>> network = models["mlp"].build(view.shape)
    >>> model = TrainedModel("mlp", crane, view, 0.0, 1.0, network=network)
    >>> value, gradient = value_and_gradient(model, crane.initial)
    >>> gradient.shape
    (352,)
    """
    torch = import_torch()
    given = np.asarray(presence, np.float64)
    beams = model.problem.lattice.beam_count
    if given.shape != (beams,) or not ((given >= 0.0) & (given <= 1.0)).all():
        raise InvalidSettings(
            f"presence: expected {beams} numbers from 0 to 1, one for each beam of "
            f"{model.problem.name!r}"
        )
    relaxation = relaxations[model.looks_at](model.view)
    where = find_device(device)
    network = model.network.to(where).eval()
    kind = next(network.parameters()).dtype
    inputs = torch.tensor(relaxation.see(given)[None], dtype=kind, device=where, requires_grad=True)
    output = network(inputs)
    (slope,) = torch.autograd.grad(output.sum(), inputs)
    back = relaxation.trace_back(given, slope[0].cpu().numpy().astype(np.float64))
    return model.mean + model.deviation * float(output.detach()), model.deviation * back
