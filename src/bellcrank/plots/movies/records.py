"""What there is to see in a movie, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem, InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """What one lattice goes through, state by state.

    Parameters
    ----------
    problem
        Whose lattice it is; N nodes, M beams.
    present : (K, M) bool
        Which beams there are in each of K states.
    bearing : (K, M) bool
        Those that carry load.
    displacement : (K, N, 2) float64, lattice units
        Of each node; not finite where it is not known, which is drawn as at rest.
    energy : (K, M) float64
        Strain energy of each beam, which gives it its colour. None draws beams in black and
        marks those that came and went since the state before.
    title
        To stand over the lattice.
    notes
        K lines under the title.
    alarms
        K lines under the notes, in the colour of warnings; may be empty.
    magnify
        How many times its size the motion is drawn.

    Raises
    ------
    InvalidProblem
        If shapes do not fit.
    InvalidSettings
        If it is to be magnified by something that is not a positive number.
    """

    problem: Problem
    present: NDArray[np.bool_]
    bearing: NDArray[np.bool_]
    displacement: NDArray[np.float64]
    energy: NDArray[np.float64] | None
    title: str
    notes: tuple[str, ...]
    alarms: tuple[str, ...]
    magnify: float = 1.0

    def __post_init__(self) -> None:
        lattice, states = self.problem.lattice, len(self.notes)
        beams = (states, lattice.beam_count)
        expected = {
            "present": beams,
            "bearing": beams,
            "displacement": (states, lattice.node_count, 2),
            "energy": beams,
            "alarms": (states,),
        }
        for name, shape in expected.items():
            given = getattr(self, name)
            if given is not None and np.shape(given) != shape:
                raise InvalidProblem(f"{name}: expected shape {shape}, got {np.shape(given)}")
        if not 0.0 < self.magnify < np.inf:
            raise InvalidSettings(f"magnify: expected a number above 0, got {self.magnify!r}")

    @property
    def moved(self) -> NDArray[np.float64]:
        """(K, N, 2) places of the nodes as drawn, lattice units."""
        known = np.isfinite(self.displacement).all(axis=2, keepdims=True)
        shift = np.where(known, self.displacement, 0.0)
        places: NDArray[np.float64] = self.problem.lattice.positions + self.magnify * shift
        return places

    @property
    def is_one_design(self) -> bool:
        """Whether no beam comes or goes."""
        return bool((self.present == self.present[0]).all())


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A curve with a dot that moves along.

    Parameters
    ----------
    x, y : (n,) float64
        May hold nan, where the curve has gaps.
    at : (K,) int64
        The point at which the dot is in each state.
    label
        What it is, where there are several.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    at: NDArray[np.int64]
    label: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Graph:
    """Curves in one frame.

    Parameters
    ----------
    across, up
        Words on the axes.
    lines
        At most one for each course.
    foreseen
        Whether what is still to come is drawn faintly from the start.
    logarithmic
        The horizontal axis.
    """

    across: str
    up: str
    lines: tuple[Line, ...]
    foreseen: bool = True
    logarithmic: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Movie:
    """All that a movie shows.

    Parameters
    ----------
    courses
        One, or two side by side, of K states each.
    graphs
        At least one.
    order : (F,) int64
        The state that each frame shows.
    """

    courses: tuple[Course, ...]
    graphs: tuple[Graph, ...]
    order: NDArray[np.int64]
