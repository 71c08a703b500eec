"""What a network sees in a design, beside what is there.

Four ways of asking the network which beams matter: hide a part of the picture behind a block,
differentiate by the presence of each beam, and let it predict each flip; and two ways of asking
the mechanics: respond to each flip, or foresee it by low-rank screening. All are changes of the
efficiency by flipping one designable beam, or stand for such, so that they can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Status
from bellcrank.surrogate.agreement import Agreement, agreement
from bellcrank.surrogate.flips import flip_effects, foreseen_by
from bellcrank.surrogate.matching import beams_between, renumbered
from bellcrank.surrogate.metrics import finite
from bellcrank.surrogate.occlusion import BLACK, WHITE, Block, occlude, picture_view, sample_map
from bellcrank.surrogate.predictor import Predictor
from bellcrank.surrogate.regions import Region, overlap_of_regions, regions_of
from bellcrank.surrogate.relaxing import value_and_gradient
from bellcrank.surrogate.views import PictureView

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem
    from bellcrank.surrogate.regions import Thresholds
    from bellcrank.surrogate.trained import TrainedModel

SUBSETS = ("all", "present", "absent")
"""Flips that correlations are told of: all, removals only, additions only."""


@dataclass(frozen=True, slots=True, eq=False)
class Occlusion:
    """What blocks over a design's picture change, in units of the efficiency.

    Parameters
    ----------
    block
        Its size, and where it went.
    white, black : (rows, columns) float64
        Change of the prediction by a block of that colour, the uppermost row first.
    low, high : (2,) float64
        Lower left and upper right corner of what the maps cover, in lattice units; the last
        column and the lowest row may reach beyond the picture.
    white_at, black_at : (n,) float64
        The maps at the middle of each designable beam.
    """

    block: Block
    white: NDArray[np.float64]
    black: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    white_at: NDArray[np.float64]
    black_at: NDArray[np.float64]

    def to_dict(self) -> dict[str, Any]:
        """Return the maps and their place as plain data."""
        return {
            "block": self.block.size,
            "stride": self.block.stride,
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "white": self.white.tolist(),
            "black": self.black.tolist(),
        }


@dataclass(frozen=True, slots=True, eq=False)
class Explanation:
    """What a network sees in a design, and what is there.

    Parameters
    ----------
    design
        As it was given.
    architecture
        Of the network.
    efficiency, predicted
        By mechanics, and by the network.
    beams : (n,) int64
        The designable ones, of which all that follows tells.
    present : (n,) bool
        Which of them the design has.
    exact, status : (n,)
        Change of the efficiency by flipping each beam, by mechanics; nan, and a `Status` that
        says why, where the flipped design has no unique response.
    screened : (n,) float64
        The same, foreseen by low-rank screening.
    network : (n,) float64
        Change of the prediction by flipping each beam.
    gradient : (n,) float64
        Derivative of the prediction by each beam's presence.
    occlusion
        None for networks that look at no pictures.
    """

    design: Design
    architecture: str
    efficiency: float
    predicted: float
    beams: NDArray[np.int64]
    present: NDArray[np.bool_]
    exact: NDArray[np.float64]
    status: NDArray[np.int64]
    screened: NDArray[np.float64]
    network: NDArray[np.float64]
    gradient: NDArray[np.float64]
    occlusion: Occlusion | None

    @property
    def slope(self) -> NDArray[np.float64]:
        """(n,) what the gradient makes of each flip: beams that are there would go."""
        return np.where(self.present, -self.gradient, self.gradient)

    def measures(self) -> dict[str, NDArray[np.float64]]:
        """Return what is to be compared with `exact`, (n,) each, by name.

        ``occlusion`` is the block that does most nearly what the flip does: white where a beam
        is there, black where none is.
        """
        found = {"screening": self.screened, "network": self.network, "gradient": self.slope}
        if self.occlusion is not None:
            white, black = self.occlusion.white_at, self.occlusion.black_at
            fitting = np.where(self.present, white, black)
            found |= {"occlusion": fitting, "white": white, "black": black}
        return found

    def correlations(self) -> dict[str, dict[str, Agreement]]:
        """Return how each measure agrees with `exact`, over each of `SUBSETS`."""
        chosen = {
            "all": np.ones(len(self.beams), np.bool_),
            "present": self.present,
            "absent": ~self.present,
        }
        return {
            name: {subset: agreement(values[chosen[subset]], self.exact[chosen[subset]])
                   for subset in SUBSETS}
            for name, values in self.measures().items()
        }  # fmt: skip

    def regions(
        self, thresholds: Thresholds | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the `Region` of each beam (n,) by mechanics, and as the network has it.

        Each is told as a fraction of the efficiency that its author gives the design.
        """
        return (
            regions_of(self.exact, self.efficiency, thresholds),
            regions_of(self.network, self.predicted, thresholds),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as plain data; what is not a number becomes None."""
        there, said = self.regions()
        return {
            "problem": self.design.problem.name,
            "mask": self.design.mask_hex,
            "architecture": self.architecture,
            "efficiency": self.efficiency,
            "predicted": self.predicted,
            "beams": self.beams.tolist(),
            "present": self.present.tolist(),
            "status": [Status(each).label for each in self.status],
            "exact": _plain(self.exact),
            "gradient": _plain(self.gradient),
            "foreseen": {name: _plain(values) for name, values in self.measures().items()},
            "regions": {
                "exact": [Region(each).label for each in there],
                "network": [Region(each).label for each in said],
                "overlap": overlap_of_regions(there, said),
            },
            "correlations": {
                name: {subset: found.to_dict() for subset, found in told.items()}
                for name, told in self.correlations().items()
            },
            "occlusion": None if self.occlusion is None else self.occlusion.to_dict(),
        }


def _plain(values: NDArray[np.float64]) -> list[float | None]:
    return [finite(value) for value in values.tolist()]


def explain(
    model: TrainedModel, design: Design, block: Block | None = None, *, device: str = "auto"
) -> Explanation:
    """Ask a network, and the mechanics, what each designable beam of a design is good for.

    Parameters
    ----------
    model
        One that has learnt the design's problem, whatever the numbering.
    design
        With a unique, stable response.
    block
        To hide parts of the picture with; by default the usual one where the network looks at
        pictures, and none elsewhere.
    device
        Where the network computes.

    Raises
    ------
    InvalidModel
        If the network has learnt another problem.
    InvalidSettings
        If the design has no unique response or no designable beam, or a block is given although
        the network looks at no pictures.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.surrogate.models import models
    >>> from bellcrank.surrogate.trained import TrainedModel
    >>> from bellcrank.surrogate.views import views
    >>> crane = find_problem("crane")
    >>> view = views["bits"](crane)
    >>> network = models["mlp"].build(view.shape)
    >>> ignorant = TrainedModel("mlp", crane, view, 0.0, 1.0, network=network)
    >>> found = explain(ignorant, crane.full_design())
    >>> found.correlations()["screening"]["all"].pearson > 0.9
    True
    """
    problem = design.problem
    if block is not None:
        picture_view(model)
    if not len(problem.designable):
        raise InvalidSettings(f"{problem.name!r} has no designable beam to explain")
    beams_there = beams_between(model.problem, problem)
    effects = flip_effects(problem, design.mask[None])
    predictor = Predictor(problem, model, device=device)
    (known,) = renumbered(design.mask[None], beams_there)
    predicted = predictor.predict(design.mask[None])[0]
    _, gradient = value_and_gradient(model, known, device=device)
    occlusion = None
    if isinstance(model.view, PictureView):
        occlusion = _occlude(model, known, problem, beams_there, block or Block(), device)
    return Explanation(
        design=design,
        architecture=model.architecture,
        efficiency=float(effects.efficiency[0]),
        predicted=float(predicted),
        beams=effects.beams,
        present=design.mask[effects.beams],
        exact=effects.exact[0],
        status=effects.status[0],
        screened=effects.screened[0],
        network=foreseen_by(predictor, design.mask[None], effects.beams)[0],
        gradient=gradient[beams_there[effects.beams]],
        occlusion=occlusion,
    )


def _occlude(
    model: TrainedModel,
    known: NDArray[np.bool_],
    problem: Problem,
    beams_there: NDArray[np.int64],
    block: Block,
    device: str,
) -> Occlusion:
    """Slide blocks over the picture that the network sees, and put the maps onto the lattice."""
    canvas = picture_view(model).renderer.canvas
    packed = np.packbits(known)
    white = occlude(model, packed, block, ink=WHITE, device=device)
    black = occlude(model, packed, block, ink=BLACK, device=device)
    learnt = model.problem.lattice
    drawn = canvas.place(learnt.positions)
    middles = drawn[learnt.beams].mean(axis=1)[beams_there[problem.designable]]
    # The canvas draws true to scale: the lattice units of a pixel follow from the extents.
    start = problem.lattice.positions.min(axis=0)
    unit = float(np.ptp(learnt.positions, axis=0).max() / np.ptp(drawn, axis=0).max())
    rows, columns = white.shape
    top_left = np.array([0.0, canvas.height])
    reach = block.stride * np.array([columns, rows], np.float64)
    low = start + (top_left - [0.0, reach[1]] - drawn.min(axis=0)) * unit
    return Occlusion(
        block, white, black, low, low + reach * unit,
        sample_map(white, block, middles, canvas.height),
        sample_map(black, block, middles, canvas.height),
    )  # fmt: skip
