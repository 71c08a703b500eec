"""Equilibrium equations of continua.

The functional that is stationary is the elastic energy plus, for each constraint on the mean
displacement m of a hub, k q (m - r(t) g) - k^2 q^2 / 2 s. Here q is the multiplier of the
constraint: its force on the part is -k q, and k = E times thickness makes q a length. t is the
load, g the prescribed displacement at full stroke, r(t) the part of it that is reached, from 0 to
1, and s the stiffness of the spring. For an exact constraint the last term
vanishes, but a very small one is kept in the stiffness, which is then quasi-definite and is
factorised without pivoting.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve, threads
from bellcrank.fem.continuum.stability import count_negative, extreme_compliances
from bellcrank.fem.continuum.system import MEAN_ORDER, integration
from bellcrank.fem.path import Linearisation
from bellcrank.model.stroke_ranges import kinks_of, rate_at, share_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.continuum.system import ContinuumSystem

TOLERANCE = 1e-6
"""Admissible residual as a fraction of the largest force on a node, before a last correction, which
reduces it to its square."""
COMPLIANCE = 1e-8
"""Compliance of exact constraints in the stiffness, as a fraction of 1 / k."""
SINGULAR = 1e12
"""Ratio of displacements to forces / k above which the stiffness is considered singular."""


class ContinuumEquations:
    """Equilibrium of a continuum with large displacements.

    The unknowns are the free displacements and the multiplier q of each constraint, all in mm.
    Only the stiffness of the last state is kept; that of an earlier state is assembled again.

    Parameters
    ----------
    system
        Mesh, material, supports and loads.
    """

    def __init__(self, system: ContinuumSystem) -> None:
        module = ngsolve()
        self.system = system
        region = system.mesh.mesh
        self.displacements = module.VectorH1(region, order=2)
        spaces = [
            module.NumberSpace(region, definedon=system.mesh.hub(constraint.node))
            for constraint in system.boundary.means
        ]
        self.space = module.FESpace([self.displacements, *spaces])
        self.state = module.GridFunction(self.space)
        self._out = self.state.vec.CreateVector()
        held = self.displacements.GetDofs(system.mesh.hub(*system.boundary.clamped.tolist()))
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
        """Deformation gradient F of the current state, a coefficient function."""
        module = ngsolve()
        return module.Id(self.system.mesh.dimension) + module.Grad(self.state.components[0])

    @cached_property
    def compliance(self) -> NDArray[np.float64]:
        """(g,) k / s of each constraint."""
        springs = np.array([constraint.spring for constraint in self.system.boundary.means])
        return np.where(np.isinf(springs), COMPLIANCE, self.system.unit / springs)

    @cached_property
    def exact(self) -> NDArray[np.bool_]:
        """(g,) whether each constraint is exact."""
        return np.array(
            [np.isinf(constraint.spring) for constraint in self.system.boundary.means], dtype=bool
        )

    @cached_property
    def hub_sizes(self) -> dict[int, float]:
        """Area, mm^2, or volume, mm^3, of each hub."""
        system = self.system
        module, region = ngsolve(), system.mesh.mesh
        sizes = module.Integrate(module.CF(1.0), region, order=MEAN_ORDER, region_wise=True)
        names = region.GetMaterials()
        return {int(node): sizes[names.index(f"hub{node}")] for node in system.mesh.hubs}

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        """Fractions of the stroke at which a force or prescribed displacement starts or stops."""
        return kinks_of(np.concatenate([self._ranges, self.system.boundary.force_range]))

    @cached_property
    def _ranges(self) -> NDArray[np.float64]:
        """(g, 2) fractions of the stroke between which the prescribed displacements grow."""
        means = self.system.boundary.means
        return np.array([constraint.during for constraint in means]).reshape(-1, 2)

    @cached_property
    def _motions(self) -> NDArray[np.float64]:
        """(g,) change of the residual by the full prescribed displacements."""
        motion = np.array([constraint.motion for constraint in self.system.boundary.means])
        return -self.system.unit * motion

    @cached_property
    def _forces(self) -> NDArray[np.float64]:
        """(G, F) change of the residual by the full forces of each range."""
        boundary = self.system.boundary
        forms = [self._hub_load(boundary.loaded, force) for force in boundary.force]
        if boundary.weight is not None:
            forms[boundary.weight_group] += self._body_force(
                self.space.TestFunction()[0], boundary.weight
            )
        rows = []
        for each in forms:
            each.Assemble()
            rows.append(-each.vec.FV().NumPy())
        return np.array(rows)

    def _load_at(self, load: float) -> NDArray[np.float64]:
        """Return (F,) the part of the residual that depends on the load."""
        shares = share_at(self.system.boundary.force_range, load)
        total: NDArray[np.float64] = shares @ self._forces
        total[len(total) - len(self._motions) :] += self._motions * share_at(self._ranges, load)
        return total

    def _hub_load(self, nodes: NDArray[np.int64], force: NDArray[np.float64]) -> Any:
        """Return the form of the work of forces (n, d) on hubs, N."""
        module, system = ngsolve(), self.system
        rules = integration(system.mesh.dimension, MEAN_ORDER)
        test = self.space.TestFunction()[0]
        form = module.LinearForm(self.space)
        for node, vector in zip(nodes.tolist(), force.tolist(), strict=True):
            pulled = sum(part * test[axis] for axis, part in enumerate(vector))
            hub = system.mesh.hub(node)
            form += pulled / self.hub_sizes[node] * module.dx(definedon=hub, intrules=rules)
        return form

    def _body_force(self, test: Any, weight: NDArray[np.float64]) -> Any:
        """Return the work of the own weight, N / mm^3."""
        module, system = ngsolve(), self.system
        pulled = sum(part * test[axis] for axis, part in enumerate(weight.tolist()))
        return system.mesh.thickness * pulled * module.dx

    def motion_by_weight(self, weight: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (f,) the linear motion at rest by the own weight (d,), N / mm^3."""
        module = ngsolve()
        form = module.LinearForm(self.space)
        form += self._body_force(self.space.TestFunction()[0], weight)
        form.Assemble()
        right: NDArray[np.float64] = form.vec.FV().NumPy()[self.free]
        self.factorise(np.zeros(self.count))
        return self.solve(right)

    def motion_by_forces(
        self, unknowns: NDArray[np.float64], nodes: NDArray[np.int64], force: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (f,) the linear motion from a state by forces (n, d) on hubs, N."""
        form = self._hub_load(nodes, force)
        form.Assemble()
        right: NDArray[np.float64] = form.vec.FV().NumPy()[self.free]
        self.factorise(unknowns)
        return self.solve(right)

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearisation:
        """Linearise the equations; raises RuntimeError if the state has no finite energy."""
        here = unknowns.copy()
        residual, tolerance = self.residual(here, load)
        if not np.isfinite(residual).all():
            raise RuntimeError("the state has no finite energy")
        self.factorise(here)
        return Linearisation(residual, tolerance, TangentFactor(self, here))

    def load_derivative(
        self,
        unknowns: NDArray[np.float64],  # noqa: ARG002
        load: float,
        toward: float = 1.0,
    ) -> NDArray[np.float64]:
        """Return (f,) the derivative of the residual with respect to the load.

        It is constant between kinks.
        """
        rates = rate_at(self.system.boundary.force_range, load, toward)
        rate: NDArray[np.float64] = rates @ self._forces
        given = self._motions * rate_at(self._ranges, load, toward)
        rate[len(rate) - len(given) :] += given
        return rate[self.free]

    def distance(self, change: NDArray[np.float64]) -> float:
        """Return the largest component of a change of the displacements, mm."""
        return float(np.abs(change[: self.moving]).max(initial=0.0))

    def set_state(self, unknowns: NDArray[np.float64]) -> None:
        """Set the current state."""
        values = self.state.vec.FV().NumPy()
        values[:] = 0.0
        values[self.free] = unknowns

    def forces(self, unknowns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (F,) the gradient of the functional at load 0, for all degrees of freedom."""
        self.set_state(unknowns)
        with threads(self.count):
            self._form.Apply(self.state.vec, self._out)
        total: NDArray[np.float64] = self._out.FV().NumPy().copy()
        count = len(self.exact)
        if count:
            given = np.where(self.exact, self.compliance, 0.0)
            total[-count:] += self.system.unit * given * unknowns[-count:]
        return total

    def residual(
        self, unknowns: NDArray[np.float64], load: float
    ) -> tuple[NDArray[np.float64], float]:
        """Return (f,) the residual and its tolerance.

        The tolerance is relative to the largest force on a node, those in clamped and driven hubs
        included, or of a constraint, plus the error by rounding.
        """
        forces = self.forces(unknowns)
        multipliers = self.system.unit * np.abs(unknowns[self.moving :]).max(initial=0.0)
        largest = max(float(np.abs(forces[: self.displacements.ndof]).max()), float(multipliers))
        moved = float(np.abs(unknowns).max(initial=0.0))
        rounding = 100.0 * float(np.finfo(float).eps) * self.system.unit * moved
        residual = forces + self._load_at(load)
        return residual[self.free], TOLERANCE * largest + rounding

    def potential(self, unknowns: NDArray[np.float64], load: float) -> float:
        """Return the functional that is stationary in equilibrium, N mm."""
        self.set_state(unknowns)
        with threads(self.count):
            stored = float(self._form.Energy(self.state.vec))
        multipliers = unknowns[self.moving :]
        stored += (
            0.5 * self.system.unit * float((self.compliance * multipliers**2)[self.exact].sum())
        )
        return stored + float(self._load_at(load)[self.free] @ unknowns)

    def factorise(self, unknowns: NDArray[np.float64]) -> None:
        """Factorise the stiffness of a state, unless that array was factorised last."""
        if self._at is unknowns:
            return
        self._at = None
        self.set_state(unknowns)
        with threads(self.count):
            self._form.AssembleLinearization(self.state.vec)
            if self._inverse is None:
                self._inverse = self._form.mat.Inverse(self._free_bits, "sparsecholesky")
            else:
                self._inverse.Update()
        self._at = unknowns

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (f,) the solution with the stiffness that was factorised last."""
        given = self._out.CreateVector()
        values = given.FV().NumPy()
        values[:] = 0.0
        values[self.free] = right
        # Threads would take longer here.
        self._out.data = self._inverse * given
        solution: NDArray[np.float64] = self._out.FV().NumPy()[self.free]
        return solution

    def extreme_compliances(self, unknowns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the extreme compliances of a state, mm / N; negative ones show instability."""
        self.factorise(unknowns)
        forces = np.zeros(self.count)

        def moved(by: NDArray[np.float64]) -> NDArray[np.float64]:
            forces[: self.moving] = by
            return self.solve(forces)[: self.moving]

        values, self._expected = extreme_compliances(
            moved, self._expected, np.random.default_rng(0)
        )
        return values

    def _assembled_form(self) -> Any:
        """Return the form of the energy and all constraints."""
        system = self.system
        module, thickness = ngsolve(), system.mesh.thickness
        dimension = system.mesh.dimension
        functions = self.space.TrialFunction()
        rules = integration(dimension, system.order)
        mean_rules = integration(dimension, MEAN_ORDER)
        stretched = module.Id(dimension) + module.Grad(functions[0])
        stored = thickness * system.law.energy(stretched, system.lame)
        form = module.BilinearForm(self.space, symmetric=False)
        form += module.Variation(stored.Compile() * module.dx(intrules=rules))
        for constraint, multiplier, compliance in zip(
            system.boundary.means, functions[1:], self.compliance.tolist(), strict=True
        ):
            moved = sum(
                part * functions[0][axis] for axis, part in enumerate(constraint.direction) if part
            )
            work = system.unit * (multiplier * moved - 0.5 * compliance * multiplier * multiplier)
            hub = module.dx(definedon=system.mesh.hub(constraint.node), intrules=mean_rules)
            form += module.Variation((work / self.hub_sizes[constraint.node]).Compile() * hub)
        return form


@dataclass(slots=True, eq=False)
class TangentFactor:
    """The factorised stiffness of one state.

    Parameters
    ----------
    equations
        Equations, which keep the factorisation of one state.
    unknowns : (f,) float64
        State.
    """

    equations: ContinuumEquations
    unknowns: NDArray[np.float64]

    @property
    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues that are found."""
        return count_negative(self.equations.extreme_compliances(self.unknowns))

    @property
    def nonsingular(self) -> bool:
        """Whether no rigid-body motion is left."""
        count = self.equations.count
        right = np.random.default_rng(0).standard_normal(count)
        moved = self.solve(self.equations.system.unit * right)
        return bool(np.linalg.norm(moved) < SINGULAR * np.linalg.norm(right))

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the solution for a right-hand side."""
        self.equations.factorise(self.unknowns)
        return self.equations.solve(right)
