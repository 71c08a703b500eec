"""Channels of a load case along the stroke, and the quantities that follow from them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.case import Channel
from bellcrank.model import CARRIED

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model import Item

    Values = NDArray[np.float64]

CHANNELS_OF: dict[str, tuple[str, ...]] = {
    "gain": ("motion", "input_motion"),
    "travel": ("motion",),
    "off_axis": ("motion",),
    "rotation": ("rotation",),
    "path_error": ("displacement",),
    "stiffness": ("stiffness",),
    "payload": ("loaded_motion", "motion"),
    "dead_load": ("carried_motion", "motion"),
    "blocked_force": ("blocked_force",),
    "sag": ("sag", "motion"),
    "input_force": ("input_force",),
    "strain": ("strain",),
    "clearance": (),
    "stable_stroke": (),
    "strut_loss": (),
    "mass": (),
}
"""Channels from which a quantity follows. The others are given (`StrokeRecord.given`)."""


@dataclass(frozen=True, slots=True, eq=False)
class StrokeRecord:
    """Channels of one load case along the stroke.

    Parameters
    ----------
    fractions : (F,)
        Fractions of the full input, ascending; the last is 1.
    channels
        (..., F, ...) values of channels.
    given
        Values of quantities that do not follow from channels: clearance, stable stroke, strut loss,
        mass.
    forces
        Forces under which loaded and carried motions of outputs were measured.
    kinks
        Fractions within the stroke, among those above, at which an input starts or stops.
    """

    fractions: NDArray[np.float64]
    channels: Mapping[Channel, Values]
    given: Mapping[str, Values | float] = field(default_factory=dict)
    forces: Mapping[Channel, float] = field(default_factory=dict)
    kinks: tuple[float, ...] = ()

    def of(self, name: str, output: str = "") -> Values:
        """Return a channel."""
        return self.channels[Channel(name, output)]


def channels_of(quantity: str, output: str) -> list[Channel]:
    """Return the channels that a quantity of an output needs.

    Examples
    --------
    >>> channels_of("gain", "tip")
    [Channel(name='motion', output='tip'), Channel(name='input_motion', output='')]
    """
    own = {"input_motion", "input_force", "strain"}
    return [Channel(name, "" if name in own else output) for name in CHANNELS_OF[quantity]]


def forces_of(items: Iterable[Item]) -> dict[Channel, float]:
    """Return the wanted forces on outputs by the channel that is measured under each.

    Examples
    --------
    >>> from bellcrank.model import Item
    >>> forces_of([Item(quantity="payload", case="a", output="tip", at_least=0.1)])
    {Channel(name='loaded_motion', output='tip'): 0.1}
    """
    return {
        channels_of(item.quantity, item.output)[0]: item.at_least
        for item in items
        if item.quantity in CARRIED and item.at_least is not None
    }


def has_channels(quantity: str, output: str, record: StrokeRecord) -> bool:
    """Whether a record contains all that a quantity follows from."""
    needed = channels_of(quantity, output)
    if not needed:
        return quantity in record.given
    return all(channel in record.channels for channel in needed)
