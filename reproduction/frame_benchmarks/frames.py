"""Frames of beams with any stiffness, supports and loads, computed by the compiled frames.

Problems of the package have supports that hold displacements or clamp, forces on nodes, and round
sections in space. Benchmarks also need hinges, moments, prescribed rotations and sections with
different stiffness in two directions. The kernels have them; here they are given as arrays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics import Status
from bellcrank.mechanics.frames.kernels.response import find_reactions, respond
from bellcrank.mechanics.frames.system import (
    allocate_memory,
    allocate_reference,
    allocate_state,
    allocate_structure,
    build_frame,
)
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.ordering import elimination_order
from bellcrank.model import Elasticity, Input, Lattice, Output, Problem, Section, Supports

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.frames.kernels.arrays import Frame


@dataclass(frozen=True, slots=True)
class Rigidity:
    """Stiffness of a cross-section; forces and lengths in the units of the benchmark.

    Parameters
    ----------
    axial
        EA.
    bending
        EI in the plane of the frame.
    bending_out
        EI out of the plane of the frame; only in space.
    torsion
        GJ; only in space.
    shear
        GA with its shear coefficient; infinite without shear deformation.
    """

    axial: float
    bending: float
    bending_out: float = 0.0
    torsion: float = 0.0
    shear: float = np.inf

    def stiffness(self, length: NDArray[np.float64], dimension: int) -> NDArray[np.float64]:
        """Return (M, 4) or (M, 8) the stiffness of beams, as the kernels expect it.

        Parameters
        ----------
        length : (M,)
            Lengths of the beams.
        dimension
            2 or 3.
        """
        columns = [self.axial / length]
        bending = [self.bending]
        if dimension == 3:
            columns.append(self.torsion / length)
            bending.append(self.bending_out)
        for rigidity in bending:
            ratio = 12.0 * rigidity / (self.shear * length**2)
            flexural = rigidity / (length * (1.0 + ratio))
            own = flexural * (4.0 + ratio)
            columns += [own, flexural * (2.0 - ratio), own]
        return np.stack(columns, axis=1)

    def in_unit(self, unit: float) -> Rigidity:
        """Return the same section in another unit of length."""
        return Rigidity(
            self.axial, self.bending / unit**2, self.bending_out / unit**2,
            self.torsion / unit**2, self.shear,
        )  # fmt: skip


class Response(NamedTuple):
    """Response of a frame, in the units of the benchmark."""

    status: Status
    displacement: NDArray[np.float64]
    """(N, d) displacement at the end of the path."""
    rotation: NDArray[np.float64]
    """(N,) rotation in the plane; (N, 4) orientation in space, unit quaternions (scalar first)."""
    force: NDArray[np.float64]
    """(N, b) forces and moments on held unknowns."""
    reached: float
    """Largest fraction of the load on the stable path from rest."""
    softest: float
    """Lowest stiffness along the path, as a part of the lower one of its values at both ends."""


@dataclass(frozen=True, slots=True, eq=False)
class BenchmarkFrame:
    """A line of beams with supports and loads.

    Parameters
    ----------
    positions : (N, d)
        Nodes in order; beam k joins nodes k and k + 1.
    rigidity
        Stiffness of all beams.
    held : dict of int to str
        Held unknowns of nodes by letters: x, y, z for displacements, r for rotations.
    load : dict of int to (b,)
        Forces and moments on nodes at full load; b is 3 in the plane and 6 in space.
    drive : dict of int to (b,)
        Prescribed displacements and rotations of held unknowns at full load.
    closed
        Whether another beam joins the last node to the first one.
    bowed
        Whether beams become shorter when they bend, as those of searches.
    """

    positions: NDArray[np.float64]
    rigidity: Rigidity
    held: dict[int, str]
    load: dict[int, ArrayLike] | None = None
    drive: dict[int, ArrayLike] | None = None
    closed: bool = False
    bowed: bool = False

    @property
    def beams(self) -> NDArray[np.int64]:
        """(M, 2) end nodes."""
        first = np.arange(len(self.positions) - (not self.closed))
        return np.stack([first, (first + 1) % len(self.positions)], axis=1)

    def respond(self, increment: float = 1.0) -> Response:
        """Follow the path of stable equilibria from rest to the full load.

        Parameters
        ----------
        increment
            Largest increment of the load.
        """
        unit = self._unit()
        frame = self._frame(unit)
        structure = allocate_structure(frame)
        memory = allocate_memory(frame, structure)
        state = allocate_state(len(frame.positions), len(frame.unit))
        present = np.ones(len(frame.beams), np.uint8)
        status, _, _ = respond(
            frame, present, allocate_reference(frame), False, -np.inf, increment, structure,
            state, memory,
        )  # fmt: skip
        snapped = status == Status.SNAPPED
        reached = float(memory.reached_load[0]) if snapped else 1.0
        find_reactions(frame, structure, reached, state, memory)
        dimension = self.positions.shape[1]
        force = np.array(memory.gradient)
        force[:, dimension:] *= unit
        return Response(
            Status(status), unit * state.u[:, :dimension],
            state.q.copy() if dimension == 3 else state.u[:, 2].copy(), force, reached,
            float(memory.reached_load[1]),
        )  # fmt: skip

    def _unit(self) -> float:
        """Return the mean length of a beam: the tolerances of the kernels refer to it."""
        first, last = self.beams.T
        lengths = np.linalg.norm(self.positions[last] - self.positions[first], axis=1)
        return float(lengths.mean())

    def _frame(self, unit: float) -> Frame:
        """Return the arrays for the kernels, in lengths of a beam."""
        count, dimension = self.positions.shape
        size = 3 * (dimension - 1)
        axis = np.eye(dimension)
        held = np.zeros((count, size), dtype=bool)
        for node, letters in self.held.items():
            for letter in letters:
                if letter == "r":
                    held[node, dimension:] = True
                else:
                    held[node, "xyz".index(letter)] = True
        moved = sorted(self.drive or {})
        loaded = next(node for node in range(count) if node not in self.held)
        problem = Problem(
            name="benchmark",
            lattice=Lattice(self.positions / unit, self.beams),
            supports=Supports(fixed=np.array([node for node in self.held if node not in moved])),
            input=Input(nodes=np.array([loaded]), direction=axis[0], drive="force", amount=1.0),
            output=Output(nodes=np.array([loaded + 1]), direction=axis[0]),
            section=Section.round(1e-3) if dimension == 3 else Section(1e-3, 1.0),
            material=Elasticity(1.0, 0.3),
            designable=np.array([0]),
        )
        frame = build_frame(
            problem, objective_of(problem, None), elements=None if self.bowed else 1
        )
        some, fully = np.asarray(held.any(axis=1)), np.asarray(held.all(axis=1))
        prescribed = np.zeros(count, np.uint8)
        prescribed[moved] = 1
        return replace(
            frame,
            section=self.rigidity.in_unit(unit).stiffness(frame.rest_length, dimension),
            held=held.astype(np.uint8),
            grounded=(fully & (prescribed == 0)).astype(np.uint8),
            prescribed=prescribed,
            partly=np.asarray(some & ~fully).astype(np.uint8),
            protected=np.ones(count, np.uint8),
            block=elimination_order(frame.beams, fully, springs=False),
            load=self._field(self.load, unit, size, moments=True)[None],
            drive=self._field(self.drive, unit, size, moments=False),
        )

    def _field(
        self, given: dict[int, ArrayLike] | None, unit: float, size: int, *, moments: bool
    ) -> NDArray[np.float64]:
        """Return (N, b) loads or prescribed motions in the unit of length."""
        field = np.zeros((len(self.positions), size))
        for node, values in (given or {}).items():
            field[node] = values
        dimension = self.positions.shape[1]
        scaled = slice(dimension, None) if moments else slice(0, dimension)
        field[:, scaled] /= unit
        return field
