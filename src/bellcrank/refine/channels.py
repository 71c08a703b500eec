"""Constraints that follow from channels along the stroke, and their derivatives by channels."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import Channel, StrokeRecord, quantity_values
from bellcrank.mechanics.items import path_deviation, reduced, scales_of
from bellcrank.model import CARRIED

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from bellcrank.model import Item

    Values = NDArray[np.float64]
    RowsAt = Callable[[Mapping[Channel, Values]], tuple[Values, Values]]
    Gradients = dict[tuple[Channel, int], Values]

STEP = 1e-6
"""Step in central differences by channels, as a part of their size."""


def bounded(item: Item, record: StrokeRecord) -> Values:
    """Return (..., q) the constraints of an item: its bounds, at each state where they hold."""
    if item.quantity in CARRIED and item.at_least and item.at_most is None:
        # The force is infinite where a load changes nothing; its inverse is smooth.
        force = quantity_values(record, item.quantity, item.output)
        return item.at_least / force - 1.0
    values = quantity_values(record, item.quantity, item.output, item.path)
    if item.quantity == "path_error" and item.path is not None and item.at_most:
        # The root mean square is curved where it is small; components at points are not.
        motion = record.of("displacement", item.output)
        apart = path_deviation(record.fractions, motion, item.path, record.kinks)
        apart = apart[..., 1::2, :].reshape(*apart.shape[:-2], -1)
        return np.concatenate([values, apart, -apart], axis=-1) / item.at_most - 1.0
    if item.quantity == "off_axis":
        motion = record.of("motion", item.output)
        normal = np.linalg.norm(motion[..., 1:], axis=-1)
        values = normal / np.abs(motion[..., -1:, 0])
    elif item.of != "every":
        values = np.stack([reduced(item, record)[0]], axis=-1)
    elif values.shape[-1] == len(record.fractions):
        chosen = (record.fractions >= item.start - 1e-9) & (record.fractions <= item.stop + 1e-9)
        values = values[..., chosen]
    low_scale, high_scale = scales_of(item)
    sides = []
    if item.at_most is not None:
        sides.append((values - item.at_most) / high_scale)
    if item.at_least is not None:
        sides.append((item.at_least - values) / low_scale)
    return np.concatenate(sides, axis=-1)


def stacked(rows: list[Values]) -> Values:
    """Return rows (..., q) side by side."""
    return np.concatenate(rows, axis=-1) if rows else np.zeros(0)


def jacobian(
    channels: Mapping[Channel, Values], rows_at: RowsAt, gradients: Gradients
) -> tuple[Values, Values]:
    """Return the derivatives of objectives and constraints by the variables.

    By central differences of both by the channels, whose own derivatives are given.
    """
    total = sum(value.size for value in channels.values())
    steps = np.concatenate(
        [np.full(v.size, STEP * max(float(np.abs(v).max()), 1e-9)) for v in channels.values()]
    )
    moved, begin = {}, 0
    for channel, value in channels.items():
        many = np.repeat(value[None], 2 * total, axis=0).reshape(2 * total, -1)
        own = np.arange(begin, begin + value.size)
        many[own, own - begin] += steps[own]
        many[total + own, own - begin] -= steps[own]
        moved[channel] = many.reshape(2 * total, *value.shape)
        begin += value.size
    by_channel = [
        (found[:total] - found[total:]) / (2.0 * steps[:, None]) if found.size else None
        for found in rows_at(moved)
    ]
    of_channels = np.concatenate(
        [
            gradients[channel, row]
            for channel, value in channels.items()
            for row in range(len(value))
        ]
    )
    none = np.zeros((0, of_channels.shape[1]))
    objective, constraint = (none if each is None else each.T @ of_channels for each in by_channel)
    return objective, constraint
