"""Designs: problems with the beams that are present."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.model.arrays import boolean_mask, locked, real_array, rebuild
from bellcrank.model.masks import pack_mask

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.model.problem import Problem


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """A problem with the beams that are present.

    Parameters
    ----------
    problem
        The problem, with the objective of `efficiency`.
    mask : (M,) bool
        Beams of the lattice that are present.
    efficiency
        Efficiency computed when the design was made; None if unknown.
    provenance
        Origin of the design, as data for JSON.

    Raises
    ------
    InvalidProblem
        If the mask has not one boolean for each beam, or the efficiency is not finite.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> design = find_problem("scaling-8").full_design()
    >>> design.beam_count
    219
    >>> design.with_mask(~design.mask).beam_count
    0
    """

    problem: Problem
    mask: NDArray[np.bool_]
    efficiency: float | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        mask = boolean_mask("mask", self.mask, self.problem.lattice.beam_count)
        object.__setattr__(self, "mask", locked(mask))
        if self.efficiency is not None:
            efficiency = float(real_array("efficiency", self.efficiency))
            object.__setattr__(self, "efficiency", efficiency)
        object.__setattr__(self, "provenance", deepcopy(dict(self.provenance)))

    __reduce__ = rebuild

    @property
    def beam_count(self) -> int:
        """Number of beams present."""
        return int(np.count_nonzero(self.mask))

    @property
    def mask_hex(self) -> str:
        """Mask as hexadecimal text."""
        return pack_mask(self.mask)

    def with_mask(self, mask: ArrayLike) -> Design:
        """Return a design with other beams and without efficiency."""
        return replace(self, mask=np.asarray(mask), efficiency=None)
