"""Continua against closed forms, independent codes, frames, and the derivatives of their energy."""

from __future__ import annotations

import importlib.util
import math
import shutil
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

if importlib.util.find_spec("ngsolve") is None:
    pytest.skip("NGSolve is not installed", allow_module_level=True)

import ngsolve as ng

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.continuum.equations import ContinuumEquations
from bellcrank.fem.continuum.fields import surface
from bellcrank.fem.continuum.laws import lame_of, laws
from bellcrank.fem.continuum.mesh import plane_mesh, triangulated
from bellcrank.fem.continuum.response import solve_mesh, solve_plane, solve_solid
from bellcrank.fem.continuum.solid import raised, solid_mesh, solid_of, tetrahedra
from bellcrank.fem.continuum.stability import count_negative, extreme_compliances
from bellcrank.fem.continuum.system import continuum_system
from bellcrank.fem.frame.equations import FrameEquations, part_frame
from bellcrank.fem.path import PathStatus, StepControl, follow_path
from bellcrank.model import Input, Lattice, Output, Problem, Supports
from bellcrank.part import Section
from bellcrank.part.materials import Material
from bellcrank.part.outline import Loop, Outline
from bellcrank.part.part import Part
from tests.fem import calculix
from tests.fem.nodes import at_nodes, quadratic

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bellcrank.fem.continuum.mesh import ContinuumMesh
    from bellcrank.fem.continuum.response import ContinuumResponse

pytestmark = pytest.mark.slow

RUBBER = Material(name="rubber", young=12.0, poisson=0.48)
NONLINEAR = [name for name, law in laws.items() if not law.small]


def two_cells(amount: float = 0.1, width: float = 2.0, spring: float | None = 2.0) -> Part:
    """Three triangles on a clamp and a roller, pushed askew against a spring."""
    height = math.sqrt(3.0) / 2.0
    problem = Problem(
        name="two cells",
        lattice=Lattice(
            [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.5, height], [1.5, height]],
            [[0, 1], [1, 2], [0, 3], [1, 3], [1, 4], [2, 4], [3, 4]],
        ),
        supports=Supports(fixed=[0], fixed_y=[2]),
        input=Input(nodes=[4], direction=[0.6, -0.8], drive="displacement", amount=amount),
        output=Output(nodes=[3], direction=[-1.0, 0.0], spring=spring),
        designable=[0],
    )
    return Part(problem.full_design(), RUBBER, Section(width, 5.0))


def clamped(part: Part) -> Part:
    """The same on two clamps, without a spring."""
    problem = part.design.problem
    output = replace(problem.output, spring=None, spring_kind=None)
    problem = replace(problem, supports=Supports(fixed=[0, 2]), output=output)
    return replace(part, design=problem.full_design())


def bar(drive: str, amount: float, direction: tuple[float, float], section: Section) -> Part:
    """A straight bar of 3 struts of 20 mm along x, clamped at the left and driven at the right."""
    problem = Problem(
        name="bar",
        lattice=Lattice([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]], [[0, 1], [1, 2], [2, 3]]),
        supports=Supports(fixed=[0]),
        input=Input(nodes=[3], direction=direction, drive=drive, amount=amount),
        output=Output(nodes=[1, 2], direction=[1.0, 0.0]),
        designable=[1],
    )
    return Part(problem.full_design(), RUBBER, section, scale=20.0)


def pushed_bar(force: float, direction: tuple[float, float], section: Section) -> Part:
    """The same with a force in N."""
    part = bar("force", 1.0, direction, section)
    problem = part.design.problem
    amount = force / (part.stiffness_unit * part.scale)
    problem = replace(problem, input=replace(problem.input, amount=amount))
    return replace(part, design=problem.full_design())


def displacements(
    part: Part, mesh: ContinuumMesh, law: str
) -> tuple[np.ndarray, ContinuumResponse]:
    """Those of the quadratic nodes at the full input."""
    response = solve_mesh(part, mesh, law)
    assert response.path.status is PathStatus.CONVERGED
    equations = ContinuumEquations(continuum_system(part, mesh, law))
    equations.set_state(response.path.states[-1].unknowns)
    return at_nodes(mesh, quadratic(mesh), equations.state.components[0]), response


@pytest.mark.parametrize("law", laws)
def test_sheets_move_as_in_scikit_fem(law: str) -> None:
    pytest.importorskip("skfem", reason="scikit-fem is not installed")
    from tests.fem import skfem_check

    part = two_cells()
    mesh = plane_mesh(part, size=2.0)
    ours, response = displacements(part, mesh, law)
    expected, force = skfem_check.respond(part, mesh, law, increments=1 if law == "linear" else 3)
    assert np.abs(ours - expected).max() < 1e-11 * np.abs(expected).max()
    assert response.states[-1].force[[4]] == pytest.approx(force, rel=1e-10)


@pytest.mark.parametrize("law", ["linear", "st-venant-kirchhoff"])
def test_bodies_move_as_in_calculix(law: str, tmp_path: Path) -> None:
    if shutil.which("ccx") is None:
        pytest.skip("CalculiX is not installed")
    part = clamped(two_cells())
    mesh = solid_mesh(part, size=2.5)
    ours, response = displacements(part, mesh, law)
    expected, force = calculix.respond(part, mesh, tmp_path, nonlinear=law != "linear")
    # CalculiX prints seven digits.
    assert np.abs(ours - expected).max() < 3e-7 * np.abs(expected).max()
    assert np.abs(response.states[-1].force[[0, 2]] - force).max() < 3e-7 * np.abs(force).max()


def ring(inner: float, outer: float) -> Outline:
    """An annulus round the origin, mm."""

    def circle(radius: float, sign: float) -> Loop:
        return Loop(np.array([[-radius, 0.0], [radius, 0.0]]), np.full(2, sign))

    return Outline(outer=(circle(outer, 1.0),), holes=(circle(inner, -1.0),))


def test_a_thick_ring_converges_at_the_order_of_curved_quadratic_elements() -> None:
    law, lame = laws["linear"], lame_of(RUBBER)
    radius = ng.sqrt(ng.x**2 + ng.y**2)
    exact = (0.02 / 1.0 + 0.03 / radius**2) * ng.CF((ng.x, ng.y))
    energies, errors = [], []
    sizes = (0.4, 0.2, 0.1)
    for size in sizes:
        mesh = triangulated(ring(1.0, 2.0), {}, 0.1, size)
        mesh.Curve(2)
        space = ng.VectorH1(mesh, order=2, dirichlet=".*")
        moved = ng.GridFunction(space)
        moved.Set(exact, ng.BND)
        form = ng.BilinearForm(space)
        trial = space.TrialFunction()
        form += ng.Variation(law.plane(ng.Id(2) + ng.Grad(trial), lame) * ng.dx)
        form.AssembleLinearization(moved.vec)
        force = moved.vec.CreateVector()
        form.Apply(moved.vec, force)
        moved.vec.data -= form.mat.Inverse(space.FreeDofs(), "sparsecholesky") * force
        energies.append(form.Energy(moved.vec))
        gap = moved - exact
        errors.append(math.sqrt(ng.Integrate(gap * gap, mesh, order=8)))
    # Of u = a r + b / r: strain a - b / r^2 along the radius, a + b / r^2 round it.
    a, b = 0.02, 0.03
    dilation = 0.5 * lame.plane_stress * (2.0 * a) ** 2 * 3.0 * math.pi
    shape = 2.0 * lame.shear * math.pi * (a**2 * 3.0 + b**2 * (1.0 - 1.0 / 4.0))
    energy_errors = np.abs(np.array(energies) - dilation - shape)
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(3.0, abs=0.3)
    assert np.log2(energy_errors[-2] / energy_errors[-1]) == pytest.approx(4.0, abs=0.4)
    assert energy_errors[-1] < 2e-6 * energies[-1]


def block(cells: int) -> ContinuumMesh:
    """The unit cube in tetrahedra, made of triangles layer by layer as parts are."""
    line = np.linspace(0.0, 1.0, cells + 1)
    flat = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right = corner + cells + 1
    lower = np.column_stack([corner, right, right + 1])
    upper = np.column_stack([corner, right + 1, corner + 1])
    elements = tetrahedra(np.concatenate([lower, upper]), len(flat), cells)
    hubs = np.full(len(elements), -1)
    return solid_of(raised(flat, 1.0, cells), elements, hubs, 0)


def test_a_block_converges_at_the_order_of_quadratic_tetrahedra() -> None:
    law, lame = laws["linear"], lame_of(RUBBER)
    # The gradient of a harmonic function changes no volume and needs no forces within.
    grown, turned = ng.exp(math.sqrt(2.0) * ng.x), (ng.sin(ng.y), ng.cos(ng.y))
    up, side = ng.sin(ng.z), ng.cos(ng.z)
    exact = 0.02 * ng.CF(
        (
            math.sqrt(2.0) * grown * turned[0] * up,
            grown * turned[1] * up,
            grown * turned[0] * side,
        )
    )
    errors = []
    for cells in (2, 4, 8):
        solid = block(cells)
        mesh = solid.mesh
        space = ng.VectorH1(mesh, order=2)
        moved = ng.GridFunction(space)
        moved.Set(exact, dual=True)
        places = solid.vertices
        free = ng.BitArray(space.ndof)
        free.Set()
        for kind, ends in (
            (ng.VERTEX, np.arange(len(places))[:, None]),
            (ng.EDGE, np.array([[end.nr for end in edge.vertices] for edge in mesh.edges])),
        ):
            outside = ((places[ends] == 0.0).all(axis=1) | (places[ends] == 1.0).all(axis=1)).any(1)
            for number in np.flatnonzero(outside).tolist():
                for dof in space.GetDofNrs(ng.NodeId(kind, number)):
                    free[dof] = False
        form = ng.BilinearForm(space)
        form += ng.Variation(law.solid(ng.Id(3) + ng.Grad(space.TrialFunction()), lame) * ng.dx)
        form.AssembleLinearization(moved.vec)
        force = moved.vec.CreateVector()
        form.Apply(moved.vec, force)
        moved.vec.data -= form.mat.Inverse(free, "sparsecholesky") * force
        gap = moved - exact
        errors.append(math.sqrt(ng.Integrate(gap * gap, mesh, order=8)))
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(3.0, abs=0.3)


def constant(values: np.ndarray) -> ng.CoefficientFunction:
    return ng.CF(tuple(values.ravel().tolist()), dims=values.shape)


@pytest.fixture(scope="module")
def value() -> Callable[[Any], Any]:
    """Of a coefficient function that is the same everywhere."""
    mesh = triangulated(ring(1.0, 2.0), {}, 0.1, 1.0)
    return lambda quantity: quantity(mesh(1.5, 0.0))


@pytest.mark.parametrize("name", laws)
def test_sheets_take_the_thickness_of_least_energy(name: str, value: Callable[[Any], Any]) -> None:
    law, lame = laws[name], lame_of(RUBBER)
    rng = np.random.default_rng(3)
    for _ in range(4):
        sheet = np.eye(2) + rng.uniform(-0.25, 0.25, (2, 2))

        def energy(stretch: float, sheet: np.ndarray = sheet) -> float:
            body = np.eye(3)
            body[:2, :2], body[2, 2] = sheet, stretch
            return value(law.solid(constant(body), lame))

        least = minimize_scalar(energy, bounds=(0.3, 2.0), options={"xatol": 1e-9})
        assert value(law.plane(constant(sheet), lame)) == pytest.approx(least.fun, rel=1e-9)
        if not law.small:
            thinning = value(law.thinning(constant(sheet), lame))
            assert math.sqrt(thinning) == pytest.approx(least.x, rel=1e-6)


@pytest.mark.parametrize("name", laws)
def test_laws_are_those_of_hooke_at_small_strains(name: str, value: Callable[[Any], Any]) -> None:
    lame = lame_of(RUBBER)
    for size in (2, 3):
        change = 1e-5 * np.random.default_rng(size).uniform(-1.0, 1.0, (size, size))
        energies = [
            value(law.energy(constant(np.eye(size) + change), lame))
            for law in (laws[name], laws["linear"])
        ]
        assert energies[0] == pytest.approx(energies[1], rel=1e-3)


@pytest.mark.parametrize("name", laws)
def test_a_pulled_sheet_bears_the_stress_of_its_stretch(
    name: str, value: Callable[[Any], Any]
) -> None:
    law, lame = laws[name], lame_of(RUBBER)

    def energy(stretch: float) -> tuple[float, float]:
        """Least energy at a stretch along x, and the stretch across it."""
        found = minimize_scalar(
            lambda across: value(law.plane(constant(np.diag([stretch, across])), lame)),
            bounds=(0.5, 1.5),
            options={"xatol": 1e-10},
        )
        return found.fun, found.x

    step = 1e-4
    nominal = (energy(1.2 + step)[0] - energy(1.2 - step)[0]) / (2.0 * step)
    across = energy(1.2)[1]
    stress = value(law.stress(constant(np.diag([1.2, across])), lame))
    # In an isotropic material the thickness shrinks as the width does.
    area = 1.0 if law.small else across**2
    assert stress[0] * area == pytest.approx(nominal, rel=1e-5)
    assert np.abs(stress[1:]).max() < 1e-5 * stress[0]


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("law", NONLINEAR)
def test_residuals_are_the_gradient_of_the_energy_and_factors_their_derivative(
    law: str, dimension: int
) -> None:
    part = two_cells()
    mesh = plane_mesh(part, size=3.0) if dimension == 2 else solid_mesh(part, size=3.0)
    equations = ContinuumEquations(continuum_system(part, mesh, law))
    rng = np.random.default_rng(4)
    smooth = equations.linearise(np.zeros(equations.count), 0.5).stiffness
    state = -smooth.solve(equations.load_derivative(np.zeros(equations.count), 0.5)) * 0.4
    along = smooth.solve(rng.standard_normal(equations.count))
    along /= np.abs(along).max()
    step = 1e-4
    ahead, behind = state + step * along, state - step * along
    residual = equations.residual(state, 0.5)[0]
    work = (equations.potential(ahead, 0.5) - equations.potential(behind, 0.5)) / (2.0 * step)
    assert residual @ along == pytest.approx(work, rel=1e-5)
    change = equations.residual(ahead, 0.5)[0] - equations.residual(behind, 0.5)[0]
    found = equations.linearise(state, 0.5).stiffness.solve(change / (2.0 * step))
    assert np.abs(found - along).max() < 1e-5
    later = (equations.residual(state, 0.6)[0] - residual) / 0.1
    assert later == pytest.approx(equations.load_derivative(state, 0.5), abs=1e-10)


def test_a_bar_has_the_stiffness_of_the_textbook() -> None:
    section = Section(2.0, 5.0)
    for solve in (solve_plane, solve_solid):
        part = bar("displacement", 0.05, (1.0, 0.0), section)
        state = solve(part, "linear").states[-1]
        stretch = (state.motion[2, 0] - state.motion[1, 0]) / part.scale
        expected = RUBBER.young * section.area * stretch
        assert state.input_force == pytest.approx(expected, rel=1e-5)
        assert state.motion[3, :2] == pytest.approx([1.0, 0.0], abs=1e-12)
        assert state.energy == pytest.approx(0.5 * state.input_force * 1.0, rel=1e-9)
        assert state.force.sum(axis=0) == pytest.approx(0.0, abs=1e-10)


def test_stress_and_strain_of_a_pulled_bar_are_uniform_between_its_hubs() -> None:
    section = Section(2.0, 5.0)
    part = bar("displacement", 0.3, (1.0, 0.0), section)
    response = solve_plane(part, "st-venant-kirchhoff")
    state, field = response.states[-1], response.fields[-1]
    middle = np.abs(field.rest[:, 0] - 30.0) < 5.0
    stretch = 1.0 + (state.motion[2, 0] - state.motion[1, 0]) / part.scale
    inner = RUBBER.young * (stretch**2 - 1.0) / 2.0
    across = 1.0 - RUBBER.poisson * (stretch**2 - 1.0)
    assert field.stress[middle] == pytest.approx(inner * stretch / across, rel=1e-4)
    assert state.strain >= stretch - 1.0
    assert field.displacement[middle, 0].mean() == pytest.approx(state.motion[1:3, 0].mean(), 1e-2)


def test_forces_and_displacements_drive_alike() -> None:
    section = Section(2.0, 5.0)
    moved = solve_plane(bar("displacement", 0.05, (0.0, 1.0), section)).states[-1]
    # A hub that is held in x as well is pulled along x.
    pull = moved.force[3]
    direction = tuple((pull / np.linalg.norm(pull)).tolist())
    pushed = solve_plane(pushed_bar(float(np.linalg.norm(pull)), direction, section)).states[-1]
    assert pushed.motion == pytest.approx(moved.motion, abs=1e-4)
    assert pushed.force[3] == pytest.approx(pull, rel=1e-9)
    assert pushed.force[0] == pytest.approx(-pull, rel=1e-6)


def portal(width: float) -> Part:
    """Two columns and a beam of 30 mm, pushed aside by 9 mm at the top."""
    problem = Problem(
        name="portal",
        lattice=Lattice([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]], [[0, 1], [1, 2], [2, 3]]),
        supports=Supports(fixed=[0, 3]),
        input=Input(nodes=[1], direction=[1.0, 0.0], drive="displacement", amount=0.3),
        output=Output(nodes=[2], direction=[1.0, 0.0]),
        designable=[0],
    )
    return Part(problem.full_design(), RUBBER, Section(width, 5.0), scale=30.0)


def test_slender_lattices_move_as_frames_do() -> None:
    part = portal(0.8)
    equations = FrameEquations(part_frame(part, 8))
    frame = equations.complete(follow_path(equations).states[-1])
    sheet = solve_plane(part).states[-1]
    assert sheet.motion[2] == pytest.approx(frame.displacement[2, :2], rel=0.03)
    assert sheet.force[1] == pytest.approx(frame.reaction[1, :2], rel=0.05)


def test_a_thin_body_is_a_sheet() -> None:
    part = bar("displacement", 0.6, (1.0, 0.0), Section(2.0, 0.5))
    sheet, body = (solve(part, size=1.5).states[-1] for solve in (solve_plane, solve_solid))
    assert body.motion[1:3, 0] == pytest.approx(sheet.motion[1:3, 0], rel=5e-3)
    assert body.input_force == pytest.approx(sheet.input_force, rel=5e-3)


def test_a_column_snaps_at_euler_s_load() -> None:
    section = Section(2.0, 5.0)
    critical = math.pi**2 * RUBBER.young * section.inertia / (4.0 * 60.0**2)
    below, above = (
        solve_plane(pushed_bar(factor * critical, (-1.0, 0.0), section), size=4.0)
        for factor in (0.95, 1.1)
    )
    assert below.path.status is PathStatus.CONVERGED
    assert above.path.status is PathStatus.SNAPPED
    # The hub that is held shortens the column by less than its radius.
    assert above.states[-1].load * 1.1 == pytest.approx(1.01, abs=0.01)


def test_unstable_states_are_found_to_be() -> None:
    section = Section(2.0, 5.0)
    critical = math.pi**2 * RUBBER.young * section.inertia / (4.0 * 60.0**2)
    part = pushed_bar(10.0 * critical, (-1.0, 0.0), section)
    equations = ContinuumEquations(continuum_system(part, plane_mesh(part)))
    straight = np.zeros(equations.count)
    for load in (0.05, 0.15, 0.5):
        # Newton's method stays on the straight path: nothing pushes the column off it.
        for _ in range(6):
            near = equations.linearise(straight, load)
            straight = straight - near.stiffness.solve(near.residual)
        assert near.stiffness.negative_eigenvalues == (load > 0.1)


def test_lanczos_finds_the_extreme_compliances() -> None:
    rng = np.random.default_rng(6)
    turn = np.linalg.qr(rng.standard_normal((60, 60)))[0]
    stiffness = np.concatenate([[-0.3, 0.1], np.geomspace(1.0, 1e4, 58)])
    inverse = turn @ np.diag(1.0 / stiffness) @ turn.T
    compliance, mode = extreme_compliances(lambda force: inverse @ force, np.zeros(60), rng)
    assert compliance[[0, -1]] == pytest.approx([-1.0 / 0.3, 10.0], rel=1e-9)
    assert count_negative(compliance) == 1
    assert abs(mode @ turn[:, 0]) == pytest.approx(1.0, abs=1e-6)


def test_isotropic_springs_resist_all_motion() -> None:
    part = bar("displacement", 0.05, (0.6, 0.8), Section(2.0, 5.0))
    output = Output(nodes=[1, 2], direction=[0.0, 1.0], spring=1.5, spring_kind="isotropic")
    problem = replace(part.design.problem, output=output)
    part = replace(part, design=problem.full_design())
    state = solve_plane(part, "linear").states[-1]
    spring = 1.5 * part.stiffness_unit
    assert state.force[1:3] == pytest.approx(-spring * state.motion[1:3], rel=1e-9)
    assert state.force.sum(axis=0) == pytest.approx(0.0, abs=1e-9)


def test_a_loose_piece_makes_a_mechanism() -> None:
    height = math.sqrt(3.0) / 2.0
    part = two_cells()
    lattice = Lattice(
        np.vstack([part.design.problem.lattice.positions, [[4.0, 0.0], [5.0, 0.0], [4.5, height]]]),
        np.vstack([part.design.problem.lattice.beams, [[5, 6], [6, 7], [5, 7]]]),
    )
    problem = replace(part.design.problem, lattice=lattice, initial=np.ones(10, dtype=bool))
    loose = replace(part, design=problem.full_design())
    for law in laws:
        response = solve_plane(loose, law, size=2.0)
        assert response.path.status is PathStatus.MECHANISM
        assert [state.load for state in response.states] == [0.0]


def test_triangles_fill_the_outline_and_hubs_are_discs() -> None:
    part = two_cells()
    mesh = plane_mesh(part)
    assert ng.Integrate(ng.CF(1.0), mesh.mesh) == pytest.approx(part.outline().area, rel=1e-4)
    equations = ContinuumEquations(continuum_system(part, mesh))
    assert list(equations.hub_sizes) == [0, 2, 3, 4]
    disc = math.pi * 0.7**2
    assert list(equations.hub_sizes.values()) == pytest.approx([disc] * 4, rel=5e-3)
    corners = mesh.vertices[mesh.elements]
    sides = corners - np.roll(corners, 1, axis=1)
    length = np.linalg.norm(sides, axis=2)
    angle = np.arccos(-(sides * np.roll(sides, -1, axis=1)).sum(axis=2)
                      / (length * np.roll(length, -1, axis=1)))  # fmt: skip
    assert np.degrees(angle.min()) > 12.0


def test_tetrahedra_fill_the_body_and_agree_on_their_faces() -> None:
    part = two_cells()
    mesh = solid_mesh(part, size=3.0, layers=3)
    corners = mesh.vertices[mesh.elements]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert (volumes > 0.0).all()
    assert volumes.sum() == pytest.approx(part.outline().area * 5.0, rel=0.01)
    faces = surface(mesh.elements)
    skin = mesh.vertices[faces]
    # Gauss's theorem over a closed surface that is seen from outside.
    assert np.linalg.det(skin).sum() / 6.0 == pytest.approx(volumes.sum(), rel=1e-9)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_results_do_not_depend_on_which_state_was_factorised_last() -> None:
    part = two_cells()
    equations = ContinuumEquations(continuum_system(part, plane_mesh(part, size=2.0)))
    right = np.random.default_rng(7).standard_normal(equations.count)
    first = equations.linearise(np.zeros(equations.count), 0.5).stiffness
    before = first.solve(right)
    other = equations.linearise(1e-2 * before / np.abs(before).max(), 0.5).stiffness
    assert np.abs(other.solve(right) - before).max() > 1e-6 * np.abs(before).max()
    assert first.solve(right) == pytest.approx(before, rel=1e-9, abs=1e-12)


def test_hubs_that_touch_are_refused() -> None:
    part = two_cells()
    lattice = Lattice(
        np.vstack([part.design.problem.lattice.positions, [[1.55, math.sqrt(3.0) / 2.0]]]),
        np.vstack([part.design.problem.lattice.beams, [[2, 5]]]),
    )
    given = Input(nodes=[4, 5], direction=[0.6, -0.8], drive="displacement", amount=0.1)
    problem = replace(
        part.design.problem, lattice=lattice, input=given, initial=np.ones(8, dtype=bool)
    )
    crowded = replace(part, design=problem.full_design(), fillet=0.0)
    with pytest.raises(InvalidSettings, match="nodes 4 and 5 are so close"):
        plane_mesh(crowded)


def test_impossible_sizes_are_refused() -> None:
    with pytest.raises(InvalidSettings, match="size: expected a length above 0 mm"):
        plane_mesh(two_cells(), size=0.0)
    with pytest.raises(InvalidSettings, match="layers: expected at least 1"):
        solid_mesh(two_cells(), layers=0)


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    with pytest.raises(InvalidSettings, match=r"pip install 'bellcrank\[fem\]'"):
        ngsolve()


def test_the_path_is_told_as_it_goes() -> None:
    loads: list[float] = []
    control = StepControl(first=0.5, largest=0.5)
    solve_plane(
        two_cells(), size=2.0, control=control, report=lambda state: loads.append(state.load)
    )
    assert loads == [0.5, 1.0]
