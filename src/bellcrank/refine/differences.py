"""Differences between the model of a refinement and better ones.

A refinement has one element in each strut. The difference of the channels of a better model, at one
geometry, is added to those of nearby geometries, so that the items follow as in the better model,
to zeroth order in the change of the geometry. The motion that is lost under a payload is multiplied
instead: one model may lose several times as much as the other, and a refinement then reduces both.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import Channel
from bellcrank.mechanics.frames.case import LOADED

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bellcrank.mechanics import StrokeRecord

    Values = NDArray[np.float64]
    Records = Mapping[str, StrokeRecord]
    """Channels along the stroke by load case."""

LARGEST_DEPARTURE = 0.5
"""Largest difference of the motions of two models on the same path, over the motion."""
LARGE_ROTATION = 30.0
"""Rotation below which differences are compared with it, degrees."""


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """Channels of a better model less those of one element in each strut, at one geometry.

    Parameters
    ----------
    channels
        Differences of channels by load case, in the shapes of the channels. A channel that is not
        known in both models has none.
    overlaps
        By how much struts overlap beyond the bound on their gaps, by load case; lattice units.
    lost
        Ratios of the motion along the direction of an output that is lost under a force on it, by
        load case and channel of the motion under this force.
    """

    channels: Mapping[str, Mapping[Channel, Values]] = field(default_factory=dict)
    overlaps: Mapping[str, float] = field(default_factory=dict)
    lost: Mapping[str, Mapping[Channel, float]] = field(default_factory=dict)

    def added_to(self, case: str, channels: Mapping[Channel, Values]) -> dict[Channel, Values]:
        """Return channels (..., F, ...) of a load case as the better model has them."""
        own = self.channels.get(case, {})
        found = {each: value + own.get(each, 0.0) for each, value in channels.items()}
        for channel, ratio in self.lost.get(case, {}).items():
            loaded = found[channel]
            motion = found[Channel("motion", channel.output)]
            loaded[..., 0] = motion[..., -1:, 0] - ratio * _lost_motion(channels, channel)
        return found


NO_DIFFERENCE = Difference()


def difference(better: Records, here: Records, gaps: Mapping[str, float]) -> Difference:
    """Return the difference of two models.

    Parameters
    ----------
    better, here
        Channels of the better model and of one element in each strut, at the same fractions.
    gaps
        Bounds on the gaps between struts by load case.
    """
    channels: dict[str, dict[Channel, Values]] = {}
    overlaps: dict[str, float] = {}
    lost: dict[str, dict[Channel, float]] = {}
    for case, record in better.items():
        own = here[case].channels
        found = {
            each: value - own[each]
            for each, value in record.channels.items()
            if each in own and value.shape == own[each].shape
        }
        channels[case] = {each: v for each, v in found.items() if np.isfinite(v).all()}
        gap = float(record.given.get("clearance", np.inf))
        # Gaps are known where they are small; the refined geometry is at the bound.
        overlaps[case] = max(0.0, gaps.get(case, 0.0) - gap)
        lost[case] = {
            each: float(wanted[0] / now[0])
            for each in channels[case]
            if each.name in LOADED
            and (now := _lost_motion(own, each))[0] > 0.0
            and (wanted := _lost_motion(record.channels, each))[0] > 0.0
        }
    return Difference(channels, overlaps, lost)


def _lost_motion(channels: Mapping[Channel, Values], loaded: Channel) -> Values:
    """Return (..., 1) the motion of an output along its direction that a force on it takes."""
    motion = channels[Channel("motion", loaded.output)]
    return np.asarray(motion[..., -1:, 0] - channels[loaded][..., 0])


def on_same_path(first: Records, second: Records, departure: float = LARGEST_DEPARTURE) -> bool:
    """Whether the motions of two models are so near to each other that they are on one path.

    Parameters
    ----------
    first, second
        Channels by load case.
    departure
        Largest difference, over the motion.
    """
    for case, record in first.items():
        inputs = [v for c, v in record.channels.items() if c.name == "input_motion"]
        for channel, value in record.channels.items():
            if channel.name not in {"motion", "displacement", "rotation"}:
                continue
            other = second[case].channels[channel]
            scales = [LARGE_ROTATION] if channel.name == "rotation" else inputs
            size = max(float(np.abs(each).max(initial=0.0)) for each in (value, *scales))
            if not float(np.abs(other - value).max()) <= departure * size:
                return False
    return True
