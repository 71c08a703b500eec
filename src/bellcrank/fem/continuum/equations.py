"""Equilibrium of a continuum: finite elements, grips and their factorised stiffness.

What is stationary is the stored energy plus, for each grip on the mean displacement m of a
hub, k q (m - t g) - k^2 q^2 / 2 s, with q the unknown by which the grip pulls (-k q is its force
on the part, k = E times thickness makes q a length), t the load, g the given motion and s the
spring. A motion that is given exactly has no last term, but a minute one in the stiffness, so that
this is quasi-definite and needs no pivoting.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve, threads
from bellcrank.fem.continuum.modes import negative, softest
from bellcrank.fem.continuum.system import MEAN_ORDER, integration
from bellcrank.fem.path import Linearised

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.continuum.system import ContinuumSystem

TOLERANCE = 1e-9
"""Residual, as a part of the largest force on a node."""
YIELDING = 1e-8
"""Of motions given exactly, in the stiffness only, as a part of k."""
LOOSE = 1e12
"""Displacement by forces of which each is k times 1 mm, as a part of 1 mm for each, from which on
nothing is held in place."""


class ContinuumEquations:
    """Equilibrium of a continuum that moves far.

    The unknowns are the free displacements and the pull q of each grip, all in mm. One stiffness
    is kept; that of a state which is asked for again after another is assembled again.

    Parameters
    ----------
    system
        Whose.
    """

    def __init__(self, system: ContinuumSystem) -> None:
        module = ngsolve()
        self.system = system
        region = system.mesh.mesh
        self.displacements = module.VectorH1(region, order=2)
        spaces = [
            module.NumberSpace(region, definedon=system.mesh.hub(grip.node))
            for grip in system.grips.means
        ]
        self.space = module.FESpace([self.displacements, *spaces])
        self.state = module.GridFunction(self.space)
        self._out = self.state.vec.CreateVector()
        held = self.displacements.GetDofs(system.mesh.hub(*system.grips.clamped.tolist()))
        is_held = np.array(list(held), dtype=bool)
        is_free = np.array(list(self.space.FreeDofs()), dtype=bool)
        is_free[: len(is_held)] &= ~is_held
        self.free: NDArray[np.int64] = np.flatnonzero(is_free)
        self._free_bits = module.BitArray(is_free.tolist())
        self.moving = int((self.free < len(is_held)).sum())
        self._form = self._assembled_form()
        self._inverse: Any = None
        self._at: NDArray[np.float64] | None = None
        self._expected = np.zeros(self.moving)

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.free)

    @property
    def gradient(self) -> Any:
        """Gradient F of the deformation in the present state, a coefficient function."""
        module = ngsolve()
        return module.Id(self.system.mesh.dimension) + module.Grad(self.state.components[0])

    @cached_property
    def yielding(self) -> NDArray[np.float64]:
        """(g,) k / s of each grip."""
        springs = np.array([grip.spring for grip in self.system.grips.means])
        return np.where(np.isinf(springs), YIELDING, self.system.unit / springs)

    @cached_property
    def exact(self) -> NDArray[np.bool_]:
        """(g,) which grips give a motion exactly."""
        return np.array([np.isinf(grip.spring) for grip in self.system.grips.means], dtype=bool)

    @cached_property
    def hub_sizes(self) -> dict[int, float]:
        """Area or volume of each hub, in mm."""
        system = self.system
        module, region = ngsolve(), system.mesh.mesh
        sizes = module.Integrate(module.CF(1.0), region, order=MEAN_ORDER, region_wise=True)
        names = region.GetMaterials()
        return {int(node): sizes[names.index(f"hub{node}")] for node in system.mesh.hubs}

    @cached_property
    def load(self) -> NDArray[np.float64]:
        """(F,) the derivative of the residual by the load, for all degrees of freedom."""
        system = self.system
        module, grips = ngsolve(), system.grips
        rules = integration(system.mesh.dimension, MEAN_ORDER)
        test = self.space.TestFunction()[0]
        form = module.LinearForm(self.space)
        for node, force in zip(grips.pushed.tolist(), grips.force.tolist(), strict=True):
            pulled = sum(part * test[axis] for axis, part in enumerate(force))
            hub = system.mesh.hub(node)
            form += pulled / self.hub_sizes[node] * module.dx(definedon=hub, intrules=rules)
        form.Assemble()
        load: NDArray[np.float64] = -form.vec.FV().NumPy()
        motion = np.array([grip.motion for grip in grips.means])
        load[len(load) - len(motion) :] -= system.unit * motion
        return load

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearised:
        """Return the equations near a state."""
        here = unknowns.copy()
        residual, tolerance = self.residual(here, load)
        if not np.isfinite(residual).all():
            raise RuntimeError("the state has no energy")
        self.factorise(here)
        return Linearised(residual, tolerance, TangentFactor(self, here))

    def pull(self, unknowns: NDArray[np.float64], load: float) -> NDArray[np.float64]:  # noqa: ARG002
        """Return (f,) the derivative of the residual by the load, the same in all states."""
        return self.load[self.free]

    def distance(self, change: NDArray[np.float64]) -> float:
        """Return the norm of a change of the displacements, mm."""
        return float(np.linalg.norm(change[: self.moving]))

    def place(self, unknowns: NDArray[np.float64]) -> None:
        """Make a state the present one."""
        values = self.state.vec.FV().NumPy()
        values[:] = 0.0
        values[self.free] = unknowns

    def forces(self, unknowns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (F,) the gradient of what is stationary at load 0, for all degrees of freedom."""
        self.place(unknowns)
        with threads(self.count):
            self._form.Apply(self.state.vec, self._out)
        total: NDArray[np.float64] = self._out.FV().NumPy().copy()
        grips = len(self.exact)
        if grips:
            given = np.where(self.exact, self.yielding, 0.0)
            total[-grips:] += self.system.unit * given * unknowns[-grips:]
        return total

    def residual(
        self, unknowns: NDArray[np.float64], load: float
    ) -> tuple[NDArray[np.float64], float]:
        """Return (f,) what is 0 in equilibrium, and how much of it is rounding.

        Forces on nodes within clamped and driven hubs, and the pulls of grips themselves, tell
        what is large.
        """
        forces = self.forces(unknowns)
        pulls = self.system.unit * np.abs(unknowns[self.moving :]).max(initial=0.0)
        largest = max(float(np.abs(forces[: self.displacements.ndof]).max()), float(pulls))
        moved = float(np.abs(unknowns).max(initial=0.0))
        rounding = 100.0 * float(np.finfo(float).eps) * self.system.unit * moved
        residual = forces + load * self.load
        return residual[self.free], TOLERANCE * largest + rounding

    def potential(self, unknowns: NDArray[np.float64], load: float) -> float:
        """Return what is stationary in equilibrium, N mm."""
        self.place(unknowns)
        with threads(self.count):
            stored = float(self._form.Energy(self.state.vec))
        pulls = unknowns[self.moving :]
        stored += 0.5 * self.system.unit * float((self.yielding * pulls**2)[self.exact].sum())
        return stored + load * float(self.load[self.free] @ unknowns)

    def factorise(self, unknowns: NDArray[np.float64]) -> None:
        """Make the inverse that of the stiffness in a state, kept by the identity of its array."""
        if self._at is unknowns:
            return
        self._at = None
        self.place(unknowns)
        with threads(self.count):
            self._form.AssembleLinearization(self.state.vec)
            if self._inverse is None:
                self._inverse = self._form.mat.Inverse(self._free_bits, "sparsecholesky")
            else:
                self._inverse.Update()
        self._at = unknowns

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (f,) the solution with the present inverse."""
        given = self._out.CreateVector()
        values = given.FV().NumPy()
        values[:] = 0.0
        values[self.free] = right
        # So short that threads take longer.
        self._out.data = self._inverse * given
        solution: NDArray[np.float64] = self._out.FV().NumPy()[self.free]
        return solution

    def compliance(self, unknowns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the extreme compliances in a state, mm / N; those below 0 are of instabilities."""
        self.factorise(unknowns)
        forces = np.zeros(self.count)

        def moved(by: NDArray[np.float64]) -> NDArray[np.float64]:
            forces[: self.moving] = by
            return self.solve(forces)[: self.moving]

        values, self._expected = softest(moved, self._expected, np.random.default_rng(0))
        return values

    def _assembled_form(self) -> Any:
        """Return the form of the energy and all grips."""
        system = self.system
        module, thickness = ngsolve(), system.mesh.thickness
        dimension = system.mesh.dimension
        trial = self.space.TrialFunction()
        rules = integration(dimension, system.order)
        mean_rules = integration(dimension, MEAN_ORDER)
        stretched = module.Id(dimension) + module.Grad(trial[0])
        stored = thickness * system.law.energy(stretched, system.lame)
        form = module.BilinearForm(self.space, symmetric=False)
        form += module.Variation(stored.Compile() * module.dx(intrules=rules))
        for grip, pull, yielding in zip(
            system.grips.means, trial[1:], self.yielding.tolist(), strict=True
        ):
            moved = sum(part * trial[0][axis] for axis, part in enumerate(grip.direction) if part)
            work = system.unit * (pull * moved - 0.5 * yielding * pull * pull)
            hub = module.dx(definedon=system.mesh.hub(grip.node), intrules=mean_rules)
            form += module.Variation((work / self.hub_sizes[grip.node]).Compile() * hub)
        return form


@dataclass(slots=True, eq=False)
class TangentFactor:
    """The factorised stiffness of one state.

    Parameters
    ----------
    equations
        That keep the factors of the state that was last asked for.
    unknowns : (f,)
        The state.
    """

    equations: ContinuumEquations
    unknowns: NDArray[np.float64]

    @property
    def negative(self) -> int:
        """Number of directions in which the state is found to be unstable."""
        return negative(self.equations.compliance(self.unknowns))

    @property
    def firm(self) -> bool:
        """Whether everything is held in place."""
        count = self.equations.count
        right = np.random.default_rng(0).standard_normal(count)
        moved = self.solve(self.equations.system.unit * right)
        return bool(np.linalg.norm(moved) < LOOSE * np.linalg.norm(right))

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the solution for a right-hand side."""
        self.equations.factorise(self.unknowns)
        return self.equations.solve(right)
