"""What there is to draw of a search: chains of accepted designs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

Axis = Literal["accepted", "proposals"]


@dataclass(frozen=True, slots=True, eq=False)
class ChainPath:
    """The designs that a chain accepted, in order.

    Parameters
    ----------
    efficiency : (n,) float64
        Of the current design after each accepted change; nan where it has none.
    step : (n,) int64
        The proposal at which each was accepted, not decreasing; only needed to draw
        against proposals.

    Raises
    ------
    InvalidSettings
        If the shapes do not fit.

    Examples
    --------
    >>> ChainPath(np.array([-0.06, 0.1, 0.3])).peak
    2
    """

    efficiency: NDArray[np.float64]
    step: NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        efficiency = np.array(self.efficiency, dtype=np.float64)
        if efficiency.ndim != 1:
            raise InvalidSettings(f"efficiency: expected shape (n,), got {efficiency.shape}")
        efficiency[~np.isfinite(efficiency)] = np.nan
        efficiency.flags.writeable = False
        object.__setattr__(self, "efficiency", efficiency)
        if self.step is not None:
            step = np.array(self.step, dtype=np.int64)
            if step.shape != efficiency.shape:
                raise InvalidSettings(
                    f"step: expected shape {efficiency.shape}, one for each efficiency, "
                    f"got {step.shape}"
                )
            step.flags.writeable = False
            object.__setattr__(self, "step", step)

    @property
    def peak(self) -> int | None:
        """Index of the greatest efficiency; None if there is none at all."""
        if not np.isfinite(self.efficiency).any():
            return None
        return int(np.nanargmax(self.efficiency))

    def along(self, axis: Axis) -> NDArray[np.float64]:
        """(n,) place of each accepted change on the axis, from 1 on.

        Raises
        ------
        InvalidSettings
            If it is to be drawn against proposals and has no `step`.
        """
        if axis == "accepted":
            return np.arange(1.0, len(self.efficiency) + 1.0)
        if self.step is None:
            raise InvalidSettings("step: needed to draw a chain against its proposals")
        return self.step.astype(np.float64) + 1.0


@dataclass(frozen=True, slots=True)
class PathsStyle:
    """What to show beside the chains.

    Parameters
    ----------
    title
        Over the figure.
    annealing_steps
        Accepted changes over which the temperature falls; 0 for none.
    human_efficiency, built_efficiency
        Of the human design and of the cleaned design that was chosen: horizontal lines.
    best
        Chain and index in it of the design that was chosen, to be marked; by default the
        highest is.
    axis
        ``"accepted"`` changes (the paper) or ``"proposals"``.
    measure
        What the curves show.
    """

    title: str = ""
    annealing_steps: int = 0
    human_efficiency: float | None = None
    built_efficiency: float | None = None
    best: tuple[int, int] | None = None
    axis: Axis = "accepted"
    measure: str = "efficiency"
