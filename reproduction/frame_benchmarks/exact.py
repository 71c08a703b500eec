"""Exact solutions of rods by elliptic integrals, shooting and zeros of functions.

They are independent of the frames.

Rods are extensible unless noted. The shooting functions integrate the equations of equilibrium of
one rod, in which the force is constant between loads, from one end, and find the unknown values
there by the conditions at the other end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reproduction.frame_benchmarks.frames import Rigidity

TOLERANCE = 1e-9
"""Relative tolerance of the integration of rods."""


@cache
def elastica(load: float) -> tuple[float, float, float]:
    """Return the tip of an inextensible cantilever under a dead force across it.

    Parameters
    ----------
    load
        P L^2 / E I.

    Returns
    -------
    shortening, deflection, angle
        Displacements along and across the cantilever over its length, and the angle of the tip in
        rad.

    References
    ----------
    K. E. Bisshopp and D. C. Drucker, Q. Appl. Math. 3, 272 (1945): elliptic integrals.

    Examples
    --------
    >>> [round(value, 5) for value in elastica(10.0)]
    [0.555, 0.81061, 1.43029]
    """
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

    def parameters(tip: float) -> tuple[float, float]:
        square = 0.5 * (1.0 + math.sin(tip))
        return square, math.asin(1.0 / math.sqrt(2.0 * square))

    def missed(tip: float) -> float:
        square, start = parameters(tip)
        return float(ellipk(square) - ellipkinc(start, square)) - math.sqrt(load)

    angle = float(brentq(missed, 1e-6, 0.5 * math.pi - 1e-9, xtol=1e-14))
    square, start = parameters(angle)
    bent = float(ellipe(square) - ellipeinc(start, square))
    reach = math.sqrt(2.0 * math.sin(angle) / load)
    return 1.0 - reach, 1.0 - 2.0 * bent / math.sqrt(load), angle


@dataclass(frozen=True, slots=True)
class PlaneRod:
    """A rod in the plane that a force P pushes down at one point.

    Parameters
    ----------
    axial, bending
        EA and EI.
    pieces
        Length, curvature at rest, and turn of the axis before each piece, rad; the first turn is
        the direction of the axis at its start.
    loaded
        Number of pieces before the loaded point.
    clamped
        Whether the start is clamped; otherwise it is hinged, as the end is unless `guided`.
    guided
        Whether the end is the loaded point itself, which moves down without rotation.
    """

    axial: float
    bending: float
    pieces: tuple[tuple[float, float, float], ...]
    loaded: int
    clamped: bool
    guided: bool = False

    def _path(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (pieces + 1, 4) x, y, angle and moment at the joints of the pieces.

        Parameters
        ----------
        values : (4,)
            Force on each section along x and y in the first piece, the moment or, at a hinge, the
            rotation at the start, and P.
        """
        from scipy.integrate import solve_ivp

        along, across, unknown, load = values
        state = np.array([0.0, 0.0, 0.0, unknown] if self.clamped else [0.0, 0.0, unknown, 0.0])
        joints = [state]
        for index, (length, curvature, turn) in enumerate(self.pieces):
            if index == self.loaded:
                across += load
            state = state + np.array([0.0, 0.0, turn, 0.0])
            found = solve_ivp(
                self._rod, (0.0, length), state, args=(along, across, curvature),
                rtol=TOLERANCE, atol=1e-12, method="DOP853",
            )  # fmt: skip
            state = found.y[:, -1]
            joints.append(state)
        return np.array(joints)

    def _rod(
        self, _s: float, state: NDArray[np.float64], along: float, across: float, curvature: float
    ) -> list[float]:
        _, _, angle, moment = state
        c, s = math.cos(angle), math.sin(angle)
        stretch = 1.0 + (along * c + across * s) / self.axial
        return [
            stretch * c, stretch * s, curvature + moment / self.bending,
            stretch * (along * s - across * c),
        ]  # fmt: skip

    def loads(self, deflections: Sequence[float]) -> list[float]:
        """Return the forces that hold deflections of the loaded point, followed from rest."""
        values = np.zeros((2, 4))
        found: list[float] = []
        for deflection in deflections:
            guess = 2.0 * values[1] - values[0] if len(found) > 1 else values[1]
            values = np.stack([values[1], self._equilibrium(deflection, guess)])
            found.append(float(values[1, 3] * self._scale[3]))
        return found

    def limit_load(self, last: float, steps: int) -> float:
        """Return the largest force for deflections up to `last`.

        Parameters
        ----------
        last
            Largest deflection.
        steps
            Number of deflections; the maximum is searched between the two beside the largest force.
        """
        from scipy.optimize import minimize_scalar

        deflections = np.linspace(0.0, last, steps + 1)
        values = np.zeros((steps + 1, 4))
        for k in range(1, steps + 1):
            guess = 2.0 * values[k - 1] - values[k - 2] if k > 2 else values[k - 1]
            values[k] = self._equilibrium(deflections[k], guess)
        top = min(int(np.argmax(values[:, 3])), steps - 1)
        peak = minimize_scalar(
            lambda deflection: -self._equilibrium(deflection, values[top])[3],
            bounds=(deflections[top - 1], deflections[top + 1]), method="bounded",
            options={"xatol": 1e-5 * last},
        )  # fmt: skip
        return float(-peak.fun * self._scale[3])

    @property
    def _scale(self) -> NDArray[np.float64]:
        """(4,) sizes of the unknown values."""
        size = sum(length for length, _, _ in self.pieces)
        force = self.bending / size**2
        return np.array([force, force, force * size if self.clamped else 1.0, force])

    def _equilibrium(self, deflection: float, guess: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (4,) the unknown values, over their sizes, at a deflection.

        Raises
        ------
        ArithmeticError
            If Newton's method does not converge.
        """
        from scipy.optimize import root

        rest, scale = self._path(np.zeros(4)), self._scale
        size = sum(length for length, _, _ in self.pieces)

        def missed(unknown: NDArray[np.float64]) -> list[float]:
            joints = self._path(unknown * scale)
            drop = (joints[self.loaded, 1] - rest[self.loaded, 1] + deflection) / size
            ends = joints[-1] - rest[-1]
            if self.guided:
                # P acts on two such halves.
                return [ends[0] / size, drop, ends[2], unknown[3] + 2.0 * unknown[1]]
            return [*(ends[:2] / size), joints[-1, 3] / (scale[3] * size), drop]

        found = root(missed, guess, tol=1e-12)
        if np.abs(missed(found.x)).max() > 1e-8:
            raise ArithmeticError(f"no equilibrium of the rod at a deflection of {deflection:g}")
        return np.asarray(found.x)


def bend_tip(
    rigidity: Rigidity, radius: float, angle: float, forces: Sequence[float]
) -> NDArray[np.float64]:
    """Return the tip displacement of a curved cantilever under a dead force normal to its plane.

    The rod stretches, bends and twists, and deforms in shear. Its axis is an arc in the plane of x
    and y that begins along x at the clamp and bends towards y.

    Parameters
    ----------
    rigidity
        Stiffness of the cross-section.
    radius, angle
        Radius, and angle of the arc in rad.
    forces
        Forces along z, ascending; each is the start of the next.

    Returns
    -------
    (3,)
        Displacement under the last one.
    """
    from scipy.integrate import solve_ivp
    from scipy.optimize import root

    length = radius * angle
    compliance = 1.0 / np.array([rigidity.axial, rigidity.shear, rigidity.shear])
    flexibility = 1.0 / np.array([rigidity.torsion, rigidity.bending_out, rigidity.bending])
    rest = np.array([0.0, 0.0, 1.0 / radius])

    def path(start: NDArray[np.float64], force: float) -> NDArray[np.float64]:
        dead = np.array([0.0, 0.0, force])

        def rod(_s: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
            point, axes = state[:3], state[3:].reshape(3, 3)
            moment = start - np.cross(point, dead)
            curve = rest + flexibility * (axes.T @ moment)
            strain = np.array([1.0, 0.0, 0.0]) + compliance * (axes.T @ dead)
            # The columns of axes turn with the curvature in their own directions.
            change = -np.cross(curve, axes)
            return np.concatenate([axes @ strain, change.ravel()])

        first = np.concatenate([np.zeros(3), np.eye(3).ravel()])
        found = solve_ivp(rod, (0.0, length), first, rtol=TOLERANCE, atol=1e-11, method="DOP853")
        return np.asarray(found.y[:3, -1])

    start, end = np.zeros(3), np.zeros(3)
    for force in forces:

        def missed(unknown: NDArray[np.float64], force: float = force) -> NDArray[np.float64]:
            point = path(unknown * force * length, force)
            free: NDArray[np.float64] = unknown - np.cross(point, [0.0, 0.0, 1.0]) / length
            return free

        found = root(missed, start, tol=1e-12)
        if np.abs(missed(found.x)).max() > 1e-9:
            raise ArithmeticError(f"no equilibrium of the rod at a force of {force:g}")
        start, end = found.x, path(found.x * force * length, force)
    tip = radius * np.array([math.sin(angle), 1.0 - math.cos(angle), 0.0])
    return end - tip


@cache
def lateral_buckling() -> float:
    """Return the critical end load of a deep cantilever in units of sqrt(EI GJ) / L^2.

    Twice the first zero of the Bessel function of order -1/4.

    References
    ----------
    S. P. Timoshenko and J. M. Gere, Theory of Elastic Stability, 2nd edition (1961), section 6.4.

    Examples
    --------
    >>> round(lateral_buckling(), 4)
    4.0126
    """
    from scipy.optimize import brentq
    from scipy.special import jv

    return 2.0 * float(brentq(lambda x: jv(-0.25, x), 1.5, 2.5, xtol=1e-14))
