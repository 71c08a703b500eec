"""Occlusion maps of a network, compared with the exact effect of each beam.

A block that covers a part of the picture changes the prediction of a network. A white block
covers beams as if they were absent, a black block as if all were present. The maps of these
changes are compared with the exact change of the efficiency by the flip of each beam, as are two
other predictions: the network's for the flipped designs, and that of a low-rank update of the
stiffness.

References
----------
M. D. Zeiler, R. Fergus, "Visualizing and understanding convolutional networks", ECCV 2014.

Examples
--------
>>> from bellcrank.model import human_design
>>> from bellcrank.surrogate.predictor import load_model
>>> crane = human_design("crane")
>>> found = attribute(load_model(crane.problem), crane, stride=32, device="cpu")
>>> found.correlations()["low_rank"] > 0.9
True
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import Design
from bellcrank.surrogate.backend import find_device
from bellcrank.surrogate.evaluator import NetworkEvaluator
from bellcrank.surrogate.matching import require_same_problem
from bellcrank.surrogate.metrics import correlation, finite
from bellcrank.surrogate.predictor import Predictor, as_trained
from bellcrank.surrogate.trained_model import run_network
from bellcrank.surrogate.views import PictureView

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.trained_model import TrainedModel

INKS = {"white": 0, "black": 255}
"""Ink of each block."""
BLOCK, STRIDE = 12, 4
"""Side of the block, and usual distance of its neighbouring positions, in pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class Attribution:
    """Effect of the beams of a design by mechanics and by a network.

    Parameters
    ----------
    design
        The design.
    architecture
        Name of the network's architecture.
    efficiency, predicted
        Efficiency by mechanics and by the network.
    beams : (n,) int64
        Designable beams.
    present : (n,) bool
        Whether the design has each of them.
    changes : {name: (n,) float64}
        Change of the efficiency by each flip: ``exact`` (by mechanics; nan where the flipped
        design has no unique response), predicted by ``low_rank`` updates and by the ``network``;
        ``white`` and ``black``: the maps at the middle of each beam.
    maps : {name: (rows, columns) float64}
        Change of the predicted efficiency by a ``white`` and a ``black`` block, the uppermost row
        first.
    low, high : (2,) float64
        Lower left and upper right corner of the maps in lattice units.
    """

    design: Design
    architecture: str
    efficiency: float
    predicted: float
    beams: NDArray[np.int64]
    present: NDArray[np.bool_]
    changes: dict[str, NDArray[np.float64]]
    maps: dict[str, NDArray[np.float64]]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def correlations(self) -> dict[str, float]:
        """Return the rank correlation of each change with ``exact``.

        White blocks are compared for present beams, black blocks for absent beams.
        """
        chosen = {"white": self.present, "black": ~self.present}
        exact, everywhere = self.changes["exact"], slice(None)
        return {
            name: rank_correlation(
                self.changes[name][chosen.get(name, everywhere)],
                exact[chosen.get(name, everywhere)],
            )
            for name in ("white", "black", "network", "low_rank")
        }

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain data; nan becomes None."""
        return {
            "problem": self.design.problem.name,
            "mask": self.design.mask_hex,
            "architecture": self.architecture,
            "efficiency": self.efficiency,
            "predicted": self.predicted,
            "beams": self.beams.tolist(),
            "present": self.present.tolist(),
            "changes": {
                name: [finite(value) for value in values.tolist()]
                for name, values in self.changes.items()
            },
            "maps": {name: values.tolist() for name, values in self.maps.items()},
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "correlations": {name: finite(rho) for name, rho in self.correlations().items()},
        }


def attribute(
    model: TrainedModel, design: Design, *, stride: int = STRIDE, device: str = "auto"
) -> Attribution:
    """Compute the occlusion maps of a network and the exact effect of each flip.

    Parameters
    ----------
    model
        Network on pictures, trained on the design's problem. The design is evaluated with the
        stiffness of that problem.
    design
        Design with a unique, stable response.
    stride
        Distance of neighbouring positions of the block in pixels.
    device
        Device of the network.

    Raises
    ------
    InvalidModel
        If the network was trained on another problem.
    InvalidSettings
        If the design has no unique response or no designable beam, the stride is less than one
        pixel, or the input of the network is not a picture or smaller than the block.
    """
    if stride < 1:
        raise InvalidSettings(f"stride: expected at least 1 pixel, got {stride}")
    design = Design(as_trained(design.problem, model), design.mask)
    problem, mask = design.problem, design.mask
    require_same_problem(model.problem, problem)
    if not len(problem.designable):
        raise InvalidSettings(f"problem {problem.name!r} has no designable beam to flip")
    view = _picture_view(model)
    predictor = Predictor(problem, model, device=device)
    flips = NetworkEvaluator(predictor).predict_flips(mask)
    packed = np.packbits(mask)
    maps = {
        name: occlude(model, packed, stride, ink=ink, device=device) for name, ink in INKS.items()
    }
    efficiency, changes = flip_effects(problem, mask)
    changes["network"] = flips.change
    lattice, canvas = problem.lattice, view.renderer.canvas
    drawn = canvas.pixels_of(lattice.positions)
    middles = drawn[lattice.beams[problem.designable]].mean(axis=1)
    for name, values in maps.items():
        changes[name] = sample_map(values, stride, middles, canvas.height)
    # Pictures are to scale: the size of a pixel follows from the extents.
    unit = float(np.ptp(lattice.positions, axis=0).max() / np.ptp(drawn, axis=0).max())
    size = stride * np.array(maps["white"].shape[::-1], np.float64)
    corner = np.array([0.0, canvas.height - size[1]])
    low = lattice.positions.min(axis=0) + (corner - drawn.min(axis=0)) * unit
    return Attribution(
        design=design,
        architecture=model.architecture,
        efficiency=efficiency,
        predicted=float(predictor.predict(mask[None])[0]),
        beams=flips.beams,
        present=mask[flips.beams],
        changes=changes,
        maps=maps,
        low=low,
        high=low + size * unit,
    )


def flip_effects(
    problem: Problem, mask: NDArray[np.bool_]
) -> tuple[float, dict[str, NDArray[np.float64]]]:
    """Return the efficiency of a design, and ``exact`` and ``low_rank`` changes by its flips.

    Raises
    ------
    InvalidSettings
        If the design has no unique, stable response.
    """
    evaluator = SpringEvaluator(problem)
    response = evaluator.evaluate(mask)
    if not response.is_admissible:
        raise InvalidSettings(
            f"the design of {problem.name!r} has no efficiency that flips could change: "
            f"{response.status.message}"
        )
    beams = np.asarray(problem.designable, np.int64)
    prediction = evaluator.predict_flips(mask, beams)
    low_rank = np.full(len(beams), np.nan) if prediction is None else prediction.change
    evaluator.set_reference()
    exact = np.full(len(beams), np.nan)
    for number, beam in enumerate(beams):
        flipped = mask.copy()
        flipped[beam] = not flipped[beam]
        found = evaluator.evaluate(flipped, warm_start=True)
        if found.is_admissible:
            exact[number] = found.efficiency - response.efficiency
    return response.efficiency, {"exact": exact, "low_rank": low_rank}


def rank_correlation(predicted: NDArray[np.float64], exact: NDArray[np.float64]) -> float:
    """Return Spearman's correlation of values (n,); entries that are not finite are left out.

    Examples
    --------
    >>> rank_correlation(np.array([1.0, 2.0, 3.0, 9.0]), np.array([2.0, 4.0, 9.0, np.nan]))
    1.0
    """
    from scipy.stats import rankdata

    known = np.isfinite(predicted) & np.isfinite(exact)
    if known.sum() < 2:
        return math.nan
    return correlation(rankdata(predicted[known]), rankdata(exact[known]))


def _picture_view(model: TrainedModel) -> PictureView:
    """Return the view of a network whose input is a picture that contains the block."""
    if not isinstance(model.view, PictureView):
        raise InvalidSettings(
            f"occlusion maps: expected a network whose input is a picture, got "
            f"{model.architecture!r}; use another network"
        )
    _, height, width = model.view.shape
    if min(height, width) < BLOCK:
        raise InvalidSettings(
            f"occlusion maps: expected pictures of at least {BLOCK} pixels, got {width} x {height}"
        )
    return model.view


def occlude(
    model: TrainedModel,
    packed: NDArray[np.uint8],
    stride: int = STRIDE,
    *,
    ink: int = INKS["white"],
    device: str = "auto",
) -> NDArray[np.float64]:
    """Return the change of the prediction by a block at each of its positions.

    Parameters
    ----------
    model
        Network whose input is a picture.
    packed : (bytes,) uint8
        Design over the beams of the model's problem.
    stride
        Distance of neighbouring positions in pixels.
    ink
        One of `INKS`.

    Returns
    -------
    (rows, columns) float64
        The uppermost row first.

    Raises
    ------
    InvalidSettings
        If the input of the network is not a picture or is smaller than the block.
    """
    view = _picture_view(model)
    picture = view.arrays(packed[None])[0]
    _, height, width = view.shape
    rows, columns = spans(height, stride), spans(width, stride)
    spots = [(row, column) for row in rows for column in columns]
    # A block over pixels of its own colour changes nothing.
    covering = [number for number, spot in enumerate(spots) if (picture[0][spot] != ink).any()]
    pictures = np.repeat(picture[None], len(covering) + 1, axis=0)
    for one, number in zip(pictures[1:], covering, strict=True):
        one[0][spots[number]] = ink
    network = model.network.to(find_device(device))
    output = run_network(network, lambda part: part, pictures, view.scale, "float32")
    change = np.zeros(len(spots))
    change[covering] = output[1:] - output[0]
    return model.deviation * change.reshape(len(rows), len(columns))


def spans(extent: int, stride: int) -> list[slice]:
    """Return the pixels that the block covers along one side of a picture, for each position.

    Examples
    --------
    >>> [(span.start, span.stop) for span in spans(12, 4)]
    [(0, 8), (0, 12), (4, 12)]
    """
    centres = [(number + 0.5) * stride for number in range(-(-extent // stride))]
    first = [math.floor(centre - 0.5 * BLOCK + 0.5) for centre in centres]
    return [slice(max(start, 0), min(start + BLOCK, extent)) for start in first]


def sample_map(
    values: NDArray[np.float64], stride: int, points: NDArray[np.float64], height: int
) -> NDArray[np.float64]:
    """Interpolate a map linearly between the positions of the block.

    Parameters
    ----------
    values : (rows, columns)
        Result of `occlude`.
    points : (n, 2)
        Pixel coordinates from the lower left corner.
    height
        Height of the picture in pixels.

    Returns
    -------
    (n,) float64
    """
    from scipy.ndimage import map_coordinates

    column = points[:, 0] / stride - 0.5
    row = (height - points[:, 1]) / stride - 0.5
    return np.asarray(map_coordinates(values, [row, column], order=1, mode="nearest"))
