"""The same sheets in scikit-fem, with stresses and stiffnesses by hand: an independent answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import skfem
from scipy.sparse import block_array, csr_array, diags_array
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from tests.fem.nodes import positions_of, quadratic

if TYPE_CHECKING:
    from bellcrank.fem.continuum.mesh import ContinuumMesh
    from bellcrank.part.part import Part


def respond(
    part: Part, mesh: ContinuumMesh, law: str, increments: int = 4
) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 2) the displacements of quadratic nodes and (i, 2) the forces on the input."""
    nodes = quadratic(mesh)
    places = positions_of(mesh, nodes)
    grid = skfem.MeshTri2(places.T, nodes.T)
    element = skfem.ElementVector(skfem.ElementTriP2())
    basis = skfem.Basis(grid, element, intorder=4)
    given, output, supports = (
        part.design.problem.input,
        part.design.problem.output,
        part.design.problem.supports,
    )
    hubs = {node: np.flatnonzero(mesh.hub_of_element == node) for node in mesh.hubs.tolist()}

    def mean(node: int, way: np.ndarray) -> np.ndarray:
        hub = skfem.Basis(grid, element, elements=hubs[node], intorder=6)
        size = skfem.Functional(lambda w: 1.0 + 0.0 * w.x[0]).assemble(hub)
        return skfem.LinearForm(lambda v, _: way[0] * v[0] + way[1] * v[1]).assemble(hub) / size

    axes = np.eye(2)
    rows = [mean(node, axis) for node in given.nodes.tolist() for axis in axes]
    goal = list((given.amount * part.scale * given.direction).ravel())
    yielding = [0.0] * len(rows)
    for held, axis in ((supports.fixed_x, axes[0]), (supports.fixed_y, axes[1])):
        rows += [mean(node, axis) for node in held.tolist()]
        goal += [0.0] * len(held)
        yielding += [0.0] * len(held)
    if output.spring is not None:
        for node, way in zip(output.nodes.tolist(), output.direction, strict=True):
            rows.append(mean(node, way))
            goal.append(0.0)
            yielding.append(1.0 / (output.spring * part.stiffness_unit))
    clamped = np.unique(
        np.concatenate([basis.get_dofs(elements=hubs[node]).all() for node in supports.fixed])
    )
    free = np.setdiff1d(np.arange(basis.N), clamped)
    means, goal = csr_array(np.array(rows)[:, free]), np.array(goal)
    moved, pulls = np.zeros(basis.N), np.zeros(len(rows))
    thickness = part.section.thickness
    for step in range(increments):
        for _ in range(8):
            stress, stiffness = kernels(law, part, basis.interpolate(moved).grad)
            forces = thickness * skfem.LinearForm(
                lambda v, _, s=stress: np.einsum("ijeq,ijeq->eq", s, v.grad)
            ).assemble(basis)
            tangent = thickness * skfem.BilinearForm(
                lambda u, v, _, k=stiffness: np.einsum("ijeq,ijeq->eq", k(u.grad), v.grad)
            ).assemble(basis)
            gap = means @ moved[free] - (step + 1) / increments * goal - yielding * pulls
            residual = np.concatenate([forces[free] + means.T @ pulls, gap])
            system = block_array(
                [[tangent[free][:, free], means.T], [means, -diags_array(yielding)]], format="csc"
            )
            change = spsolve(system, residual)
            moved[free] -= change[: len(free)]
            pulls -= change[len(free) :]
    apart, of_node = cKDTree(places).query(basis.doflocs.T)
    assert apart.max() < 1e-9
    displacement = np.zeros_like(places)
    component = np.zeros(basis.N, dtype=int)
    component[basis.split_indices()[1]] = 1
    displacement[of_node, component] = moved
    return displacement, -pulls[: 2 * len(given.nodes)].reshape(-1, 2)


def kernels(law: str, part: Part, gradient: np.ndarray):
    """Return the nominal stress P (2, 2, e, q), and what maps a change of F to that of P."""
    young, ratio, mu = part.material.young, part.material.poisson, part.material.shear
    first = young * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
    thin = young * ratio / (1.0 - ratio**2)
    unit = np.eye(2)[:, :, None, None]

    def trace(a):
        return a[0, 0] + a[1, 1]

    def turned(a):
        return a.transpose(1, 0, 2, 3)

    def times(a, b):
        return np.einsum("ij...,jk...->ik...", a, b)

    def hooke(strain):
        return thin * trace(strain) * unit + 2.0 * mu * strain

    if law == "linear":

        def small(change):
            return hooke((change + turned(change)) / 2.0)

        return small(gradient), small
    deformed = gradient + unit
    if law == "st-venant-kirchhoff":
        inner = hooke((times(turned(deformed), deformed) - unit) / 2.0)

        def change_of(change):
            strain = times(turned(deformed), change)
            return times(change, inner) + times(deformed, hooke((strain + turned(strain)) / 2.0))

        return times(deformed, inner), change_of
    area = deformed[0, 0] * deformed[1, 1] - deformed[0, 1] * deformed[1, 0]
    inverse = np.empty_like(deformed)
    inverse[0, 0], inverse[1, 1] = deformed[1, 1] / area, deformed[0, 0] / area
    inverse[0, 1], inverse[1, 0] = -deformed[0, 1] / area, -deformed[1, 0] / area
    bulk = first + 2.0 * mu
    soft = 2.0 * mu + first * area**2
    # P = mu F + g(J) F^-T with g = lambda / 2 (J^2 c - 1) - mu and c the squared thinning.
    pressure = first / 2.0 * (bulk * area**2 / soft - 1.0) - mu
    slope = first / 2.0 * bulk * 4.0 * mu * area / soft**2

    def change_of_rubber(change):
        across = times(inverse, change)
        grown = slope * area * trace(across) * turned(inverse)
        return mu * change + grown - pressure * turned(times(across, inverse))

    return mu * deformed + pressure * turned(inverse), change_of_rubber
