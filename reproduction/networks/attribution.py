"""Attribution: which beams of a design matter, to a network and to the mechanics.

A block that covers a part of the picture changes the network's prediction (occlusion); so does
the flip of a beam. Both are compared with the exact change of efficiency by each flip, and with
its prediction by a low-rank update of the stiffness.

References
----------
M. D. Zeiler, R. Fergus, "Visualizing and understanding convolutional networks", ECCV 2014, for
occlusion maps.

Examples
--------
>>> from bellcrank.model import human_design
>>> from bellcrank.surrogate.predictor import load_model
>>> crane = human_design("crane")
>>> found = attribute(load_model(crane.problem), crane, Block(stride=32), device="cpu")
>>> found.correlations()["low_rank"]["all"].pearson > 0.9
True
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Design
from bellcrank.surrogate.backend import find_device
from bellcrank.surrogate.evaluator import NetworkEvaluator
from bellcrank.surrogate.matching import beams_between, renumbered
from bellcrank.surrogate.metrics import correlation, finite
from bellcrank.surrogate.predictor import Predictor
from bellcrank.surrogate.trained_model import run_network
from bellcrank.surrogate.views import PictureView

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.trained_model import TrainedModel

WHITE, BLACK = 0, 255
"""Ink of a block."""
SUBSETS = ("all", "present", "absent")
"""Flips over which correlations are computed: all, removals, additions."""
TOP = 30
"""Number of best flips in `Agreement.recall`."""
ENOUGH = 4 * TOP
"""Smallest number of flips for a recall; a random ranking finds a quarter of the best then."""
VITAL, NEUTRAL = 0.5, 0.05
"""Limits of regions, as fractions of the efficiency of the design."""
LEAST_EFFICIENCY = 0.05
"""Smallest efficiency in these fractions."""


class Region(IntEnum):
    """Effect of the flip of a beam on the function of a design."""

    VITAL = 0
    USEFUL = 1
    NEUTRAL = 2
    ADVERSE = 3
    UNSTABLE = 4

    @property
    def label(self) -> str:
        """Name in files."""
        return self.name.lower()


@dataclass(frozen=True, slots=True)
class Block:
    """A square that slides over a picture.

    Parameters
    ----------
    size
        Side in pixels.
    stride
        Distance of neighbouring positions in pixels.

    Raises
    ------
    InvalidSettings
    """

    size: int = 12
    stride: int = 4

    def __post_init__(self) -> None:
        for name in ("size", "stride"):
            value = getattr(self, name)
            if value < 1:
                raise InvalidSettings(f"block {name}: expected at least 1 pixel, got {value}")

    def centres(self, extent: int) -> NDArray[np.float64]:
        """Return the positions of the centre along one side of a picture, in pixels.

        Examples
        --------
        >>> Block(size=12, stride=4).centres(12)
        array([ 2.,  6., 10.])
        """
        return np.asarray((np.arange(-(-extent // self.stride)) + 0.5) * self.stride, np.float64)

    def span(self, centre: float, extent: int) -> slice:
        """Return the pixels that the block covers around a centre."""
        first = int(np.floor(centre - 0.5 * self.size + 0.5))
        return slice(max(first, 0), min(max(first + self.size, 0), extent))


@dataclass(frozen=True, slots=True, eq=False)
class Occlusion:
    """Change of the prediction by blocks that cover parts of the picture.

    Parameters
    ----------
    block
        Size and stride.
    white, black : (rows, columns) float64
        Change of the predicted efficiency by a block of that colour, the uppermost row first.
    low, high : (2,) float64
        Lower left and upper right corner of the maps in lattice units.
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


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of predicted with exact changes of efficiency.

    Parameters
    ----------
    pearson, spearman
        Correlation of the values and of their ranks; nan where one side is constant.
    recall
        Share of the `TOP` best flips among the `TOP` flips with the best prediction; nan for
        fewer than `ENOUGH` flips.
    count
        Number of flips.
    """

    pearson: float
    spearman: float
    recall: float
    count: int

    def to_dict(self) -> dict[str, float | int | None]:
        """Return the measures as plain data; nan becomes None."""
        return {name: finite(value) for name, value in asdict(self).items()}


@dataclass(frozen=True, slots=True, eq=False)
class Attribution:
    """Effect of each flip of a design by mechanics and by a network.

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
    exact, status : (n,)
        Change of the efficiency by each flip by mechanics; nan where the flipped design has no
        unique response, with the `bellcrank.mechanics.Status` that says why.
    low_rank : (n,) float64
        The same change predicted by a low-rank update.
    network : (n,) float64
        Change of the network's prediction by each flip.
    occlusion
        None for networks whose input is not a picture.
    """

    design: Design
    architecture: str
    efficiency: float
    predicted: float
    beams: NDArray[np.int64]
    present: NDArray[np.bool_]
    exact: NDArray[np.float64]
    status: NDArray[np.int64]
    low_rank: NDArray[np.float64]
    network: NDArray[np.float64]
    occlusion: Occlusion | None

    def measures(self) -> dict[str, NDArray[np.float64]]:
        """Return the changes (n,) to compare with `exact`, by name.

        ``occlusion`` is the white block at present beams and the black block at absent ones.
        """
        found = {"low_rank": self.low_rank, "network": self.network}
        if self.occlusion is not None:
            white, black = self.occlusion.white_at, self.occlusion.black_at
            both = np.where(self.present, white, black)
            found |= {"occlusion": both, "white": white, "black": black}
        return found

    def correlations(self) -> dict[str, dict[str, Agreement]]:
        """Return the agreement of each measure with `exact` over each of `SUBSETS`."""
        chosen = {
            "all": np.ones(len(self.beams), np.bool_),
            "present": self.present,
            "absent": ~self.present,
        }
        return {
            name: {
                subset: agreement(values[chosen[subset]], self.exact[chosen[subset]])
                for subset in SUBSETS
            }
            for name, values in self.measures().items()
        }

    def regions(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the `Region` of each beam (n,) by mechanics and by the network."""
        return regions_of(self.exact, self.efficiency), regions_of(self.network, self.predicted)

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain data; nan becomes None."""
        exact, network = self.regions()
        seen = self.occlusion
        return {
            "problem": self.design.problem.name,
            "mask": self.design.mask_hex,
            "architecture": self.architecture,
            "efficiency": self.efficiency,
            "predicted": self.predicted,
            "beams": self.beams.tolist(),
            "present": self.present.tolist(),
            "status": [Status(each).label for each in self.status],
            "exact": [finite(value) for value in self.exact.tolist()],
            "measures": {
                name: [finite(value) for value in values.tolist()]
                for name, values in self.measures().items()
            },
            "regions": {
                "exact": [Region(each).label for each in exact],
                "network": [Region(each).label for each in network],
                "overlap": overlap_of_regions(exact, network),
            },
            "correlations": {
                name: {subset: found.to_dict() for subset, found in rows.items()}
                for name, rows in self.correlations().items()
            },
            "occlusion": None
            if seen is None
            else {
                "block": seen.block.size,
                "stride": seen.block.stride,
                **{
                    name: getattr(seen, name).tolist() for name in ("low", "high", "white", "black")
                },
            },
        }


def attribute(
    model: TrainedModel, design: Design, block: Block | None = None, *, device: str = "auto"
) -> Attribution:
    """Compute the effect of each flip of a design by mechanics and by a network.

    Parameters
    ----------
    model
        Network trained on the design's problem, in any numbering. The design is evaluated with
        the stiffness of that problem.
    design
        Design with a unique, stable response.
    block
        Block for occlusion maps; by default the usual one if the network's input is a picture.
    device
        Device of the network.

    Raises
    ------
    InvalidModel
        If the network was trained on another problem.
    InvalidSettings
        If the design has no unique response or no designable beam, or a block is given although
        the input of the network is not a picture.
    """
    design = Design(replace(design.problem, stiffness=model.problem.stiffness), design.mask)
    problem = design.problem
    if block is not None:
        picture_view(model)
    if not len(problem.designable):
        raise InvalidSettings(f"problem {problem.name!r} has no designable beam to flip")
    efficiency, exact, status, low_rank = flip_effects(problem, design.mask)
    predictor = Predictor(problem, model, device=device)
    flips = NetworkEvaluator(predictor).predict_flips(design.mask)
    seen = None
    if isinstance(model.view, PictureView):
        seen = _occlusion(model, design, block or Block(), device)
    return Attribution(
        design=design,
        architecture=model.architecture,
        efficiency=efficiency,
        predicted=float(predictor.predict(design.mask[None])[0]),
        beams=flips.beams,
        present=design.mask[flips.beams],
        exact=exact,
        status=status,
        low_rank=low_rank,
        network=flips.change,
        occlusion=seen,
    )


def flip_effects(
    problem: Problem, mask: NDArray[np.bool_]
) -> tuple[float, NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Evaluate a design and all its flips of designable beams with the mechanics.

    Returns
    -------
    efficiency : float
    exact, status, low_rank : (n,)
        As in `Attribution`.

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
    low_rank = np.full(len(beams), np.nan)
    prediction = evaluator.predict_flips(mask, beams)
    if prediction is not None:
        low_rank[:] = prediction.change
    evaluator.set_reference()
    exact, status = np.full(len(beams), np.nan), np.empty(len(beams), np.int64)
    for number, beam in enumerate(beams):
        flipped = mask.copy()
        flipped[beam] = not flipped[beam]
        found = evaluator.evaluate(flipped, warm_start=True)
        status[number] = found.status
        if found.is_admissible:
            exact[number] = found.efficiency - response.efficiency
    return response.efficiency, exact, status, low_rank


def agreement(predicted: NDArray[np.float64], exact: NDArray[np.float64]) -> Agreement:
    """Compare predicted with exact changes (n,); entries that are not finite are left out.

    Examples
    --------
    >>> found = agreement(np.array([1.0, 2.0, 3.0, 9.0]), np.array([2.0, 4.0, 6.0, np.nan]))
    >>> found.pearson, found.count
    (1.0, 3)
    """
    from scipy.stats import rankdata

    known = np.isfinite(predicted) & np.isfinite(exact)
    guess, truth = np.asarray(predicted)[known], np.asarray(exact)[known]
    if len(truth) < 2:
        return Agreement(math.nan, math.nan, math.nan, len(truth))
    recall = math.nan
    if len(truth) >= ENOUGH:
        best, named = (np.argsort(-values, kind="stable")[:TOP] for values in (truth, guess))
        recall = len(np.intersect1d(best, named)) / TOP
    ranks = correlation(rankdata(guess), rankdata(truth))
    return Agreement(correlation(guess, truth), ranks, recall, len(truth))


def regions_of(change: NDArray[np.float64], efficiency: float) -> NDArray[np.int64]:
    """Return the `Region` of each beam.

    Where the efficiency is negative, a flip that increases it harms the function of the design.

    Parameters
    ----------
    change : (n,)
        Change of the efficiency by each flip; nan for a flipped design without a unique response.
    efficiency
        Efficiency of the design.

    Examples
    --------
    >>> regions_of(np.array([-0.9, -0.2, 0.001, 0.3, np.nan]), efficiency=1.0).tolist()
    [0, 1, 2, 3, 4]
    """
    part = change / float(np.copysign(max(abs(efficiency), LEAST_EFFICIENCY), efficiency))
    region = np.full(len(change), Region.NEUTRAL, np.int64)
    region[part >= NEUTRAL] = Region.ADVERSE
    region[part <= -NEUTRAL] = Region.USEFUL
    region[part <= -VITAL] = Region.VITAL
    region[~np.isfinite(change)] = Region.UNSTABLE
    return region


def overlap_of_regions(
    first: NDArray[np.int64], second: NDArray[np.int64]
) -> dict[str, float | None]:
    """Return Jaccard's index of each region; None where it is empty in both.

    Examples
    --------
    >>> overlap_of_regions(np.array([0, 0, 2]), np.array([0, 2, 2]))["vital"]
    0.5
    """
    found: dict[str, float | None] = {}
    for region in Region:
        here, there = first == region, second == region
        either = int((here | there).sum())
        found[region.label] = int((here & there).sum()) / either if either else None
    return found


def picture_view(model: TrainedModel) -> PictureView:
    """Return the view of a network whose input is a picture.

    Raises
    ------
    InvalidSettings
        If its input is not a picture.
    """
    if not isinstance(model.view, PictureView):
        raise InvalidSettings(
            f"block: expected a network whose input is a picture, got {model.architecture!r}; "
            f"leave out the block, or use another network"
        )
    return model.view


def occlude(
    model: TrainedModel,
    packed: NDArray[np.uint8],
    block: Block,
    *,
    ink: int = WHITE,
    device: str = "auto",
) -> NDArray[np.float64]:
    """Return the change of the prediction by a block at each of its positions.

    Parameters
    ----------
    model
        Network whose input is a picture.
    packed : (bytes,) uint8
        Design over the beams of the model's problem.
    block
        Size and stride.
    ink
        `WHITE` covers beams as if they were absent, `BLACK` as if all were present.

    Returns
    -------
    (rows, columns) float64
        The uppermost row first.

    Raises
    ------
    InvalidSettings
        If the input of the network is not a picture, or the block is larger than it.
    """
    view = picture_view(model)
    _, height, width = view.shape
    if block.size > min(height, width):
        raise InvalidSettings(
            f"block size: expected at most {min(height, width)} pixels for pictures of "
            f"{width} x {height}, got {block.size}"
        )
    picture = view.arrays(packed[None])[0]
    rows, columns = block.centres(height), block.centres(width)
    spots = [
        (block.span(row, height), block.span(column, width)) for row in rows for column in columns
    ]
    # A block over pixels of its own colour changes nothing.
    covering = [number for number, spot in enumerate(spots) if (picture[0][spot] != ink).any()]
    pictures = np.repeat(picture[None], len(covering) + 1, axis=0)
    for one, number in zip(pictures[1:], covering, strict=True):
        one[0][spots[number]] = ink
    where = find_device(device)
    output = run_network(
        model.network.to(where), lambda part: part, pictures, view.scale, "float32"
    )
    change = np.zeros(len(spots))
    change[covering] = output[1:] - output[0]
    return model.deviation * change.reshape(len(rows), len(columns))


def sample_map(
    values: NDArray[np.float64], block: Block, places: NDArray[np.float64], height: int
) -> NDArray[np.float64]:
    """Interpolate a map linearly between the positions of the block.

    Parameters
    ----------
    values : (rows, columns)
        Result of `occlude`.
    places : (n, 2)
        Pixel coordinates from the lower left corner.
    height
        Height of the picture in pixels.

    Returns
    -------
    (n,) float64
    """
    from scipy.ndimage import map_coordinates

    column = places[:, 0] / block.stride - 0.5
    row = (height - places[:, 1]) / block.stride - 0.5
    return np.asarray(map_coordinates(values, [row, column], order=1, mode="nearest"))


def _occlusion(model: TrainedModel, design: Design, block: Block, device: str) -> Occlusion:
    """Compute both maps and their values at the beams, in the numbering of the design."""
    problem, known = design.problem, model.problem.lattice
    beams = beams_between(model.problem, problem)
    canvas = picture_view(model).renderer.canvas
    packed = np.packbits(renumbered(design.mask[None], beams)[0])
    white = occlude(model, packed, block, ink=WHITE, device=device)
    black = occlude(model, packed, block, ink=BLACK, device=device)
    drawn = canvas.pixels_of(known.positions)
    middles = drawn[known.beams].mean(axis=1)[beams[problem.designable]]
    # Pictures are to scale: the size of a pixel follows from the extents.
    unit = float(np.ptp(known.positions, axis=0).max() / np.ptp(drawn, axis=0).max())
    rows, columns = white.shape
    size = block.stride * np.array([columns, rows], np.float64)
    corner = np.array([0.0, canvas.height - size[1]])
    low = problem.lattice.positions.min(axis=0) + (corner - drawn.min(axis=0)) * unit
    return Occlusion(
        block, white, black, low, low + size * unit,
        sample_map(white, block, middles, canvas.height),
        sample_map(black, block, middles, canvas.height),
    )  # fmt: skip
