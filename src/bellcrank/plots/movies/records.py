"""The content of a movie as plain arrays, and the protocol of a source of frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.errors import InvalidProblem, InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem


@dataclass(frozen=True, slots=True, eq=False)
class StateSequence:
    """The states of one lattice.

    Parameters
    ----------
    problem
        Problem with N nodes and M beams.
    present : (M,) bool
        Beams of the design.
    load_bearing : (M,) bool
        Beams that carry load.
    displacement : (K, N, d) float64, lattice units
        Displacement of each node in each of K states. Nodes with values that are not finite are
        drawn at rest.
    energy : (K, M) float64
        Strain energy of each beam, shown as its colour.
    title
        Heading of the lattice.
    notes
        K lines below the heading.
    alarms
        K lines below the notes, in the warning colour; may be empty.
    magnify
        Factor by which the drawn displacement is larger than the computed one.

    Raises
    ------
    InvalidProblem
        If an array has the wrong shape.
    InvalidSettings
        If `magnify` is not positive and finite.
    """

    problem: Problem
    present: NDArray[np.bool_]
    load_bearing: NDArray[np.bool_]
    displacement: NDArray[np.float64]
    energy: NDArray[np.float64]
    title: str
    notes: tuple[str, ...]
    alarms: tuple[str, ...]
    magnify: float = 1.0

    def __post_init__(self) -> None:
        lattice, states = self.problem.lattice, len(self.notes)
        beams = lattice.beam_count
        expected = {
            "present": (beams,),
            "load_bearing": (beams,),
            "displacement": (states, *lattice.positions.shape),
            "energy": (states, beams),
            "alarms": (states,),
        }
        for name, shape in expected.items():
            given = getattr(self, name)
            if np.shape(given) != shape:
                raise InvalidProblem(f"{name}: expected shape {shape}, got {np.shape(given)}")
        if not 0.0 < self.magnify < np.inf:
            raise InvalidSettings(f"magnify: expected a number above 0, got {self.magnify!r}")

    @property
    def moved(self) -> NDArray[np.float64]:
        """(K, N, d) drawn positions of the nodes, lattice units."""
        known = np.isfinite(self.displacement).all(axis=2, keepdims=True)
        shift = np.where(known, self.displacement, 0.0)
        points: NDArray[np.float64] = self.problem.lattice.positions + self.magnify * shift
        return points


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A curve with a marker that moves along it.

    The whole curve is drawn faintly from the first frame on.

    Parameters
    ----------
    x, y : (n,) float64
        Coordinates; nan leaves a gap.
    at : (K,) int64
        Index of the point that the marker shows in each state.
    label
        Legend entry, used if a graph has several lines.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    at: NDArray[np.int64]
    label: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Graph:
    """The curves of one pair of axes.

    Parameters
    ----------
    x_label, y_label
        Axis labels.
    lines
        At most one line for each state sequence.
    """

    x_label: str
    y_label: str
    lines: tuple[Line, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Movie:
    """The complete content of a movie.

    Parameters
    ----------
    sequences
        One lattice, or two side by side, with K states each.
    graphs
        At least one.
    order : (F,) int64
        State that each frame shows.
    """

    sequences: tuple[StateSequence, ...]
    graphs: tuple[Graph, ...]
    order: NDArray[np.int64]


class FrameSource(Protocol):
    """An object that draws the frames of a movie."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""

    @property
    def order(self) -> NDArray[np.int64]:
        """(F,) state that each frame shows; equal states have equal pictures."""

    def draw(self, state: int) -> NDArray[np.uint8]:
        """Return a new (height, width, 4) array of red, green, blue and opacity."""
