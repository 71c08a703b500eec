"""Values and violations of the items of a specification, from channels along the stroke.

All functions accept leading axes, so that the same code evaluates one response and the predicted
responses of many flips.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics.splines import STEPS, spline_basis
from bellcrank.mechanics.stroke_record import CHANNELS_OF, channels_of
from bellcrank.model import CARRIED, QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics.stroke_record import StrokeRecord
    from bellcrank.model import Item, ObjectiveTerm

    Values = NDArray[np.float64]

ZERO_SCALE = {
    "ratio": 0.05, "length": 0.1, "angle": 2.0, "force": 1e-3, "stiffness": 1e-3, "volume": 1.0,
}  # fmt: skip
"""Scale of the violation of a bound that is zero, by dimension."""
TWO_SIDED = 4.0
"""Factor of the reserve of items with two bounds, over that of items with one."""
LARGER_RESERVE = {"strain": 4.0, "clearance": 4.0}
"""The same for quantities that one element in each beam, and few states along the stroke, show
less accurately."""
PATH_POINTS = STEPS
"""Number of points at which a path is compared with the wanted one."""
LARGEST_EXCESS = 1e3
"""Largest ratio of an excess to its scale, that of values that are infinite or unknown."""
LARGEST_OBJECTIVE = 1e6
"""Largest size of an objective, that of values that are infinite."""
MOST_LOADS = 100.0
"""Largest payload or dead load as an objective, over the load that is applied: a load that costs
hardly any travel says nothing about one that halves it."""
SMALLEST_TRAVEL = 1e-9
"""Travel below which ratios to it count as infinite."""


def quantity_values(
    record: StrokeRecord, quantity: str, output: str = "", path: Values | None = None
) -> Values:
    """Return a quantity: (..., F) where it has a value at every state, else (..., 1).

    Parameters
    ----------
    record
        Channels along the stroke.
    quantity, output
        Name of the quantity, and of the output.
    path : (k, 2), optional
        The wanted path, for ``path_error``.
    """
    if quantity in record.given:
        return np.asarray(record.given[quantity], dtype=np.float64)[..., None]
    if quantity == "path_error":
        assert path is not None
        motion = record.of("displacement", output)
        return path_error(record.fractions, motion, path, record.kinks)[..., None]
    own = channels_of(quantity, output)
    if "motion" not in CHANNELS_OF[quantity]:
        return record.channels[own[0]]
    motion = record.of("motion", output)
    if quantity in CARRIED:
        # The travel decreases linearly with the load, to first order.
        loaded = record.channels[own[0]][..., 0]
        lost = _ratio(motion[..., -1:, 0] - loaded, motion[..., -1:, 0])
        return _ratio(np.full(lost.shape, 0.5 * record.forces[own[0]]), np.maximum(lost, 0.0))
    return _of_motion(quantity, motion, *(record.channels[each] for each in own))


def objective_value(record: StrokeRecord, objective: ObjectiveTerm) -> Values:
    """Return (...) the value of an objective over its scale, at full stroke.

    It is finite unless a channel is unknown. An output that moves against its direction carries
    nothing.
    """
    value = quantity_values(record, objective.quantity, objective.output)[..., -1]
    if objective.quantity in CARRIED:
        force = record.forces[channels_of(objective.quantity, objective.output)[0]]
        moved = record.of("motion", objective.output)[..., -1, 0]
        value = np.where(moved > 0.0, np.minimum(value, MOST_LOADS * force), 0.0)
    return np.asarray(np.clip(value / objective.scale, -LARGEST_OBJECTIVE, LARGEST_OBJECTIVE))


def _of_motion(quantity: str, motion: Values, *channels: Values) -> Values:
    """Return a quantity that depends on the motion of the output and on other channels."""
    along = motion[..., 0]
    travel = np.abs(along[..., -1:])
    if quantity == "gain":
        along = _ratio(along, channels[1])
    elif quantity == "off_axis":
        normal = np.linalg.norm(motion[..., 1:], axis=-1)
        along = _ratio(normal.max(axis=-1, keepdims=True), travel)
    elif quantity == "sag":
        along = _ratio(channels[0], travel)
    return along


def _ratio(numerator: Values, denominator: Values) -> Values:
    """Return a ratio, infinite where the denominator vanishes."""
    small = np.abs(denominator) < SMALLEST_TRAVEL
    if not small.any():
        return np.asarray(numerator / denominator)
    infinite = np.broadcast_to(np.where(numerator < 0.0, -np.inf, np.inf), small.shape).copy()
    return np.asarray(np.divide(numerator, denominator, out=infinite, where=~small))


def path_error(
    fractions: NDArray[np.float64],
    displacement: Values,
    path: Values,
    kinks: tuple[float, ...] = (),
) -> Values:
    """Return the root mean square distance of a motion from a wanted path, over its length.

    Parameters are those of `path_deviation`.

    Returns
    -------
    (...)

    Examples
    --------
    >>> motion = np.array([[1.0, 0.0], [3.0, 0.0]])
    >>> error = path_error(np.array([0.5, 1.0]), motion, np.array([[0.0, 0.0], [3.0, 0.0]]))
    >>> round(float(error), 12)
    0.0
    """
    apart = path_deviation(fractions, displacement, path, kinks)
    return np.asarray(np.sqrt((apart**2).sum(axis=-1).mean(axis=-1)))


def path_deviation(
    fractions: NDArray[np.float64],
    displacement: Values,
    path: Values,
    kinks: tuple[float, ...] = (),
) -> Values:
    """Return how far a motion is from a wanted path, over the length of the path.

    A cubic spline through the states is compared with the path at equal fractions of the lengths
    of both, so that the pace along the path is free.

    Parameters
    ----------
    fractions : (F,)
        Fractions of the stroke.
    displacement : (..., F, 2)
        Displacement there.
    path : (k, 2)
        Corners of the path, relative to the first one.
    kinks
        Fractions at which the motion may turn sharply.

    Returns
    -------
    (..., P, 2)
        At P points; infinite for a motion without length.
    """
    path = np.asarray(path) - path[0]
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    length = float(steps.sum())
    at = np.concatenate([[0.0], np.cumsum(steps)]) / length
    share = np.arange(1, PATH_POINTS + 1) / PATH_POINTS
    wanted = np.stack([np.interp(share, at, path[:, axis]) for axis in range(2)], axis=-1)
    points = np.asarray(displacement)
    start = np.zeros((*points.shape[:-2], 1, 2))
    basis = spline_basis(tuple(fractions.tolist()), kinks)
    fine = basis @ np.concatenate([start, points], axis=-2)
    moved = np.linalg.norm(np.diff(fine, axis=-2), axis=-1)
    reached = np.concatenate([np.zeros((*moved.shape[:-1], 1)), np.cumsum(moved, axis=-1)], axis=-1)
    total = reached[..., -1:]
    if reached.ndim == 1:
        if not (np.isfinite(total[0]) and total[0] > 0.0):
            return np.full((PATH_POINTS, 2), np.inf)
        there = np.stack(
            [np.interp(share * total[0], reached, fine[:, axis]) for axis in range(2)], axis=-1
        )
        return np.asarray((there - wanted) / length)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = reached / total
    # The piece of the spline in which each share of its length lies, and where in it.
    piece = np.minimum((along[..., None, 1:] < share[:, None] - 1e-12).sum(-1), len(basis) - 2)
    low, high = (np.take_along_axis(along, piece + k, axis=-1) for k in (0, 1))
    part = np.divide(share - low, high - low, out=np.zeros_like(low), where=high > low)
    ends = [np.take_along_axis(fine, (piece + k)[..., None], axis=-2) for k in (0, 1)]
    there = ends[0] + part[..., None] * (ends[1] - ends[0])
    is_known = (np.isfinite(total) & (total > 0.0))[..., None]
    return np.where(is_known, (there - wanted) / length, np.inf)


def scales_of(item: Item) -> tuple[float, float]:
    """Return the sizes of the lower and the upper bound of an item, which normalise violations.

    A bound that is zero, or missing, has the size of the other one.

    Examples
    --------
    >>> from bellcrank.model import Item
    >>> scales_of(Item(quantity="input_force", at_least=0.1, at_most=2.0))
    (0.1, 2.0)
    >>> scales_of(Item(quantity="input_force", at_least=0.0, at_most=2.0))
    (2.0, 2.0)
    """
    low, high = abs(item.at_least or 0.0), abs(item.at_most or 0.0)
    other = max(low, high) or ZERO_SCALE[QUANTITIES[item.quantity].dimension]
    return low or other, high or other


def tightened(item: Item, reserve: float) -> Item:
    """Return an item whose bounds are tighter by a part of their size.

    Two bounds approach their mean by four times this part of half their distance; a single one
    moves by this part of its size, or of `ZERO_SCALE`, and in some quantities more
    (`LARGER_RESERVE`).

    Examples
    --------
    >>> from bellcrank.model import Item
    >>> tightened(Item(quantity="sag", case="push", output="tip", at_most=0.2), 0.1).at_most
    0.18
    """
    low, high = item.at_least, item.at_most
    if low is not None and high is not None:
        half = 0.5 * max(0.0, 1.0 - TWO_SIDED * reserve) * (high - low)
        middle = 0.5 * (low + high)
        return replace(item, at_least=middle - half, at_most=middle + half)
    step = LARGER_RESERVE.get(item.quantity, 1.0) * reserve * max(scales_of(item))
    if low is not None:
        return replace(item, at_least=low + step)
    assert high is not None
    return replace(item, at_most=high - step)


def reduced(item: Item, record: StrokeRecord) -> tuple[Values, Values]:
    """Return the smallest and the largest value that the bounds of an item apply to, each (...)."""
    values = quantity_values(record, item.quantity, item.output, item.path)
    if values.shape[-1] > 1:
        chosen = (record.fractions >= item.start - 1e-9) & (record.fractions <= item.stop + 1e-9)
        values = values[..., chosen]
    low, high = values.min(axis=-1), values.max(axis=-1)
    if item.of == "largest":
        return high, high
    if item.of == "smallest":
        return low, low
    if item.of == "spread":
        mean = np.abs(values.mean(axis=-1))
        spread = _ratio(high - low, mean)
        return spread, spread
    return low, high


class Bounds(NamedTuple):
    """Bounds of items, and their sizes (`scales_of`).

    Each is one number, or an array of one for each item. A bound that is missing is nan.
    """

    least: float | Values
    most: float | Values
    least_scale: float | Values
    most_scale: float | Values

    @classmethod
    def of(cls, item: Item) -> Bounds:
        """Return the bounds of an item."""
        least = math.nan if item.at_least is None else item.at_least
        most = math.nan if item.at_most is None else item.at_most
        return cls(least, most, *scales_of(item))

    @classmethod
    def of_all(cls, items: Sequence[Item]) -> Bounds:
        """Return the bounds of several items as arrays (I,)."""
        return cls(*np.array([cls.of(item) for item in items]).reshape(-1, 4).T)


def relative_distance(bounds: Bounds, low: Values, high: Values) -> Values:
    """Return by how much values exceed the bounds of items, over the size of the bound.

    Negative within the bounds; then its opposite is the margin.

    Parameters
    ----------
    bounds
        Bounds of one item, or of as many as the last axis of the values has.
    low, high : (...)
        Smallest and largest value that the bounds apply to (`reduced`).
    """
    over = np.fmax(
        (high - bounds.most) / bounds.most_scale, (bounds.least - low) / bounds.least_scale
    )
    return np.where(np.isnan(over), np.inf, over)


def violation(bounds: Bounds, low: Values, high: Values) -> Values:
    """Return the violation of items: ln(1 + e / s), e the excess and s the size of the bound.

    It is 0 if an item is met, and ln 2 at an excess of the size of the bound. The parameters are
    those of `relative_distance`.
    """
    return np.log1p(np.clip(relative_distance(bounds, low, high), 0.0, LARGEST_EXCESS))


def worst_value(item: Item, record: StrokeRecord) -> float:
    """Return the value that is nearest to violating an item, or violates it most."""
    low, high = (float(each) for each in reduced(item, record))
    if item.at_most is None:
        return low
    if item.at_least is None:
        return high
    low_scale, high_scale = scales_of(item)
    above, below = (high - item.at_most) / high_scale, (item.at_least - low) / low_scale
    return high if above >= below else low


def margin(item: Item, value: float) -> float:
    """Return the distance of a value from the nearest bound, over its size; negative beyond."""
    return -float(relative_distance(Bounds.of(item), np.asarray(value), np.asarray(value)))


TOLERANCE = 1e-9
"""Violation up to which an item is met."""


class ItemResult(NamedTuple):
    """An item with the value that a design reaches."""

    item: Item
    value: float
    violation: float
    margin: float

    @property
    def met(self) -> bool:
        """Whether the item is met."""
        return self.violation <= TOLERANCE


def item_results(items: Sequence[Item], records: Mapping[str, StrokeRecord]) -> list[ItemResult]:
    """Return items with the values that a design reaches.

    Parameters
    ----------
    items
        Items of a specification.
    records
        Channels of the design in each load case.
    """
    found = []
    for item in items:
        record = records[item.case] if item.case else next(iter(records.values()))
        value = worst_value(item, record)
        own = float(violation(Bounds.of(item), *reduced(item, record)))
        found.append(ItemResult(item, value, own, margin(item, value)))
    return found
