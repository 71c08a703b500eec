"""Scenarios: deviations of a part from its drawing, and losses of single struts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model.tolerances import USUAL, Tolerances, out_of_range

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray
    from scipy.sparse import csr_matrix

    from bellcrank.model import Input, Problem

    Values = NDArray[np.float64]

Kind = Literal["nominal", "widths", "input", "stroke", "print", "strut"]
"""Kinds of scenarios. Those of the kind ``"print"`` are random, all others are not."""
LARGEST = {"width": math.inf, "thin": 0.9, "shortest": 1.0, "longest": 3.0}
"""Largest values of deviations; the smallest one is 0."""
NARROWEST = 0.05
"""Least width of a strut, as a part of its nominal width."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviations:
    """Sizes of deviations, and the number of random prints.

    Parameters
    ----------
    tolerances
        Deviations of random prints; those of all widths and of the direction are computed alone
        too.
    width
        Further deviation of all widths, in both directions, lattice units.
    thin
        Part of the width by which all struts may be too thin: a printer's thin walls.
    shortest, longest
        Strokes, as parts of the nominal one.
    prints
        Number of random prints.
    struts
        Whether the loss of each strut is computed.
    seed
        Seed of the random prints.

    Raises
    ------
    InvalidSettings
        If a number is out of its range.
    """

    tolerances: Tolerances = USUAL
    width: float = 0.01
    thin: float = 0.2
    shortest: float = 0.5
    longest: float = 1.5
    prints: int = 200
    struts: bool = True
    seed: int = 0

    def __post_init__(self) -> None:
        if fault := out_of_range(self, LARGEST):
            raise InvalidSettings(fault)
        if self.prints < 0:
            raise InvalidSettings(f"prints: expected at least 0, got {self.prints}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scenario:
    """A deviation of a design.

    Parameters
    ----------
    name
        What deviates, in words.
    kind
        One of `Kind`.
    widths : (M,)
        Widths of the struts as parts of the nominal ones; None for those.
    moves : (N, d)
        Displacements of the nodes, lattice units; None for none.
    angle
        Rotation of the directions of all inputs, degrees.
    plane
        The two axes of the plane of this rotation.
    stroke
        Input as a part of the nominal one.
    missing
        Beam that is missing; None for none.
    """

    name: str
    kind: Kind
    widths: Values | None = None
    moves: Values | None = None
    angle: float = 0.0
    plane: tuple[int, int] = (0, 1)
    stroke: float = 1.0
    missing: int | None = None

    def scaled(self, factor: float) -> Scenario:
        """Return the scenario with all deviations multiplied by a factor; no width is too small."""
        widths = self.widths
        if widths is not None:
            widths = np.maximum(1.0 + factor * (widths - 1.0), NARROWEST)
        return replace(
            self,
            widths=widths,
            moves=None if self.moves is None else factor * self.moves,
            angle=factor * self.angle,
            stroke=1.0 + factor * (self.stroke - 1.0),
        )

    def of(self, problem: Problem) -> Problem:
        """Return the problem of a frame with this deviation; the missing beam is still in it.

        Raises
        ------
        InvalidProblem
            If a strut is not longer than wide.
        """
        lattice, widths, joints = problem.lattice, problem.widths, problem.joints
        if self.moves is not None:
            lattice = replace(lattice, positions=lattice.positions + self.moves)
        if self.widths is not None:
            widths = problem.beam_widths * self.widths
            joints = None if joints is None else joints * self.widths[:, None]
        wanted = problem.specification
        if wanted is not None:
            cases = tuple(replace(case, input=self._of_input(case.input)) for case in wanted.cases)
            wanted = replace(wanted, cases=cases)
        return replace(
            problem, lattice=lattice, widths=widths, joints=joints,
            input=self._of_input(problem.input), specification=wanted,
        )  # fmt: skip

    def joint_slopes(self, drawn: csr_matrix) -> csr_matrix:
        """Return the derivatives of the joints of a print by its positions and widths.

        Parameters
        ----------
        drawn : (2 M, N d + M) sparse
            Those of the drawn part, by the positions and widths drawn.
        """
        from scipy.sparse import diags

        if self.widths is None:
            return drawn
        by_joint = np.repeat(self.widths, 2)
        by_column = np.ones(drawn.shape[1])
        by_column[-len(self.widths) :] = 1.0 / self.widths
        printed: csr_matrix = diags(by_joint) @ drawn @ diags(by_column)
        return printed

    def _of_input(self, given: Input) -> Input:
        """Return an input with another direction and stroke."""
        if self.angle == 0.0 and self.stroke == 1.0:
            return given
        turned = given.direction.copy()
        first, second = self.plane
        cosine, sine = math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))
        turned[:, first] = cosine * given.direction[:, first] - sine * given.direction[:, second]
        turned[:, second] = sine * given.direction[:, first] + cosine * given.direction[:, second]
        return replace(given, direction=turned, amount=self.stroke * given.amount)


def scenarios_of(
    problem: Problem, mask: NDArray[np.bool_], deviations: Deviations, length: float = 1.0
) -> list[Scenario]:
    """Return the scenarios of a design, the nominal one first.

    Parameters
    ----------
    problem
        Problem of a frame.
    mask : (M,) bool
        The design.
    deviations
        Their sizes.
    length
        Length of a lattice unit in mm, for the names of scenarios.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> design = human_design("crane")
    >>> problem = frame_problem(design.problem, PartSpec())
    >>> few = Deviations(prints=2, struts=False)
    >>> [scenario.name for scenario in scenarios_of(problem, design.mask, few, 10.0)][:4]
    ['nominal', 'widths +0.1 mm', 'widths -0.1 mm', 'widths +10 %']
    """
    found = [Scenario(name="nominal", kind="nominal")]
    found += _widths(problem, deviations, length)
    planes, largest = _planes(problem), deviations.tolerances.angle
    for plane in planes if largest else ():
        for angle in (largest, -largest):
            about = "" if len(planes) == 1 else f" in the plane {'xyz'[plane[0]]}{'xyz'[plane[1]]}"
            name = f"input turned by {angle:+g} degrees{about}"
            found.append(Scenario(name=name, kind="input", angle=angle, plane=plane))
    for stroke in (deviations.shortest, deviations.longest):
        if stroke not in {0.0, 1.0}:
            found.append(Scenario(name=f"stroke {stroke:.0%}", kind="stroke", stroke=stroke))
    found += _prints(problem, deviations)
    if deviations.struts:
        held = np.isin(problem.lattice.beams, problem.supports.fixed).all(axis=1)
        found += [
            Scenario(name=f"without strut {beam}", kind="strut", missing=beam)
            for beam in np.flatnonzero(mask & ~held).tolist()
        ]
    return found


def _widths(problem: Problem, deviations: Deviations, length: float) -> Iterator[Scenario]:
    """Yield scenarios in which all widths deviate alike."""
    nominal = problem.beam_widths
    for sign in (1.0, -1.0):
        if deviations.width:
            widths = np.maximum(1.0 + sign * deviations.width / nominal, NARROWEST)
            name = f"widths {sign * length * deviations.width:+g} mm"
            yield Scenario(name=name, kind="widths", widths=widths)
    relative = deviations.tolerances.width
    parts = [relative, -relative, -deviations.thin]
    for part in dict.fromkeys(part for part in parts if part):
        widths = np.full(len(nominal), 1.0 + part)
        yield Scenario(name=f"widths {100.0 * part:+g} %", kind="widths", widths=widths)


def _planes(problem: Problem) -> list[tuple[int, int]]:
    """Return the planes in which the direction of the input may turn."""
    if problem.lattice.dimension == 2:
        return [(0, 1)]
    along = int(np.abs(problem.input.direction[0]).argmax())
    return [(along, axis) for axis in range(3) if axis != along]


def _prints(problem: Problem, deviations: Deviations) -> Iterator[Scenario]:
    """Yield random prints; each is determined by the seed and its number."""
    planes, sizes = _planes(problem), deviations.tolerances
    nominal = problem.beam_widths
    for number in range(deviations.prints):
        rng = np.random.default_rng([deviations.seed, number])
        common = 1.0 + sizes.width * rng.uniform(-1.0, 1.0)
        widths = common * (1.0 + sizes.each_width * rng.standard_normal(len(nominal)))
        moves = sizes.node * rng.uniform(-1.0, 1.0, problem.lattice.positions.shape)
        yield Scenario(
            name=f"print {number + 1}", kind="print", widths=np.maximum(widths, NARROWEST),
            moves=moves, angle=sizes.angle * rng.uniform(-1.0, 1.0),
            plane=planes[int(rng.integers(len(planes)))],
        )  # fmt: skip
