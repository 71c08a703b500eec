"""Frames against closed forms, an independent code and figures that several codes agree on."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bellcrank.fem import FemSettings, levels
from bellcrank.fem.frame.analysis import energy
from bellcrank.fem.frame.equations import FrameEquations, FrameState, PartFrame, part_frame
from bellcrank.fem.path import PathState, PathStatus, StabilityLoss, StepControl, follow_path
from bellcrank.mechanics import FrameEvaluator
from bellcrank.model import (
    Design,
    Input,
    Lattice,
    Output,
    Problem,
    Supports,
    find_problem,
    read_problem,
)
from bellcrank.part import PartSpec, Section, frame_problem
from bellcrank.part.materials import Material
from bellcrank.part.part import Part
from bellcrank.search import clean
from bellcrank.workflows import find_design
from tests.fem import opensees

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "crane.problem.json"
RUBBER = Material(name="rubber", young=12.0, poisson=0.48)


def linear(part: Part, elements: int, theory: str = "euler-bernoulli") -> FrameState:
    """The response for small displacements."""
    return FrameEquations(part_frame(part, elements, theory)).solve_linear()


def loaded(part: Part, elements: int, theory: str = "euler-bernoulli") -> FrameState:
    """The equilibrium under the full input."""
    equations = FrameEquations(part_frame(part, elements, theory))
    path = follow_path(equations)
    assert path.status is PathStatus.CONVERGED
    return equations.complete(path.states[-1])


def crane_part(crane: Problem, width: float, stroke: float) -> Part:
    moved = replace(crane, input=replace(crane.input, amount=stroke / 10.0))
    return Part(moved.full_design(), RUBBER, Section(width, 5.0))


def figures(part: Part, state: FrameState) -> list[float]:
    """Mean output motion in x and y, force in y summed over the input."""
    problem = part.design.problem
    motion = state.displacement[problem.output.nodes, :2].mean(axis=0)
    return [*motion, state.reaction[problem.input.nodes, 1].sum()]


@pytest.fixture(scope="module")
def reference_crane() -> Problem:
    if not REFERENCE.exists():
        pytest.skip("the node table of these figures is not in this checkout")
    return read_problem(REFERENCE)


@pytest.mark.parametrize(
    ("theory", "width", "expected"),
    [
        ("euler-bernoulli", 1.0, (3.015062782e-2, 3.480436969e-2, -5.412679980)),
        ("euler-bernoulli", 2.0, (3.464962720e-2, 3.261786336e-2, -11.06770131)),
        ("timoshenko", 2.0, (3.392924848e-2, 3.293548739e-2, -11.02935494)),
    ],
)
@pytest.mark.parametrize("elements", [1, 8])
def test_linear_figures_that_several_codes_agree_on(
    reference_crane: Problem, theory: str, width: float, expected: tuple, elements: int
) -> None:
    part = crane_part(reference_crane, width, 1.0)
    assert figures(part, linear(part, elements, theory)) == pytest.approx(expected, rel=5e-9)


@pytest.mark.parametrize(
    ("stroke", "expected"),
    [
        (1.0, (3.962278969e-2, 3.595412958e-2, -10.93101755)),
        (4.330127, (0.2456675696, 0.2050114827, -45.16177558)),
    ],
)
def test_nonlinear_figures_that_several_codes_agree_on(
    reference_crane: Problem, stroke: float, expected: tuple
) -> None:
    part = crane_part(reference_crane, 2.0, stroke)
    assert figures(part, loaded(part, 8)) == pytest.approx(expected, rel=5e-8)


def diluted(name: str, seed: int) -> Part:
    """A connected random part of a lattice with displaced nodes."""
    rng = np.random.default_rng(seed)
    problem = find_problem(name)
    lattice = problem.lattice
    jitter = rng.uniform(-0.08, 0.08, lattice.positions.shape)
    moved = Lattice(lattice.positions + jitter, lattice.beams)
    problem = replace(problem, lattice=moved, input=replace(problem.input, amount=0.1))
    mask = problem.initial.copy()
    for beam in rng.permutation(problem.designable)[: len(problem.designable) // 3]:
        mask[beam] = False
    first, second = moved.beams[mask].T
    graph = coo_array((np.ones(len(first)), (first, second)), (moved.node_count,) * 2)
    piece = connected_components(graph, directed=False)[1]
    mask &= piece[moved.beams[:, 0]] == piece[problem.input.nodes[0]]
    return Part(Design(problem, mask), RUBBER, Section(rng.uniform(1.0, 2.5), 4.8))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("theory", "nonlinear"),
    [("euler-bernoulli", False), ("euler-bernoulli", True), ("timoshenko", False)],
)
@pytest.mark.parametrize(("name", "seed"), [("crane", 1), ("scaling-8", 2), ("discs", 3)])
def test_diluted_lattices_move_as_in_opensees(
    name: str, seed: int, theory: str, nonlinear: bool
) -> None:
    try:
        import openseespy.opensees  # noqa: F401
    except (ImportError, RuntimeError):
        pytest.skip("OpenSeesPy is not installed, or its system libraries (libblas3) are not")
    part = diluted(name, seed)
    motion, force = opensees.respond(part, 3, theory, nonlinear=nonlinear)
    state = loaded(part, 3, theory) if nonlinear else linear(part, 3, theory)
    scale = np.abs(motion).max()
    assert np.abs(state.displacement[: len(motion), :2] - motion).max() < 1e-8 * scale
    held = part.design.problem.input.nodes
    ours = state.reaction[held, :2]
    assert np.abs(ours - force[held]).max() < 1e-7 * np.abs(force[held]).max()


LENGTH, SECTION = 100.0, Section(1.0, 5.0)
BENDING = RUBBER.young * SECTION.inertia
SLENDER = Section(0.25, 5.0)


def chain(force: float, direction: tuple[float, float], section: Section = SECTION) -> Part:
    """A straight bar of two struts along x, clamped at the left, with a force at the right."""
    lattice = Lattice([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]], [[0, 1], [1, 2]])
    problem = Problem(
        name="bar",
        lattice=lattice,
        supports=Supports(fixed=[0]),
        input=Input(nodes=[2], direction=direction, drive="force", amount=1.0),
        output=Output(nodes=[1], direction=[0.0, 1.0]),
        designable=[0],
    )
    part = Part(problem.full_design(), RUBBER, section, scale=LENGTH)
    amount = force / (part.stiffness_unit * part.scale)
    loaded = replace(problem, input=replace(problem.input, amount=amount))
    return replace(part, design=loaded.full_design())


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_a_cantilever_bends_as_in_the_textbook(theory: str) -> None:
    part = chain(1e-3, (0.0, 1.0))
    state = linear(part, 3, theory)
    bent = 1e-3 * LENGTH**3 / (3.0 * BENDING)
    shear = 1e-3 * LENGTH / (5.0 / 6.0 * RUBBER.shear * SECTION.area)
    expected = bent + (shear if theory == "timoshenko" else 0.0)
    assert state.displacement[2, 1] == pytest.approx(expected, rel=1e-9)
    assert state.displacement[2, 2] == pytest.approx(1.5 * bent / LENGTH, rel=1e-9)


def portal(width: float) -> tuple[Part, float]:
    """Two clamped columns and a bar between their heads, all alike, pushed sideways at a head."""
    lattice = Lattice([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], [[0, 2], [2, 3], [1, 3]])
    problem = Problem(
        name="portal",
        lattice=lattice,
        supports=Supports(fixed=[0, 1]),
        input=Input(nodes=[2], direction=[1.0, 0.0], drive="force", amount=1e-6),
        output=Output(nodes=[3], direction=[1.0, 0.0]),
        designable=[1],
    )
    part = Part(problem.full_design(), RUBBER, Section(width, 5.0), scale=LENGTH)
    return part, 1e-6 * part.stiffness_unit * part.scale


def test_a_portal_sways_as_in_the_textbook_the_more_so_the_more_slender_it_is() -> None:
    # Slope deflection, struts of equal length L and E I that do not stretch: 5 P L^3 / (84 E I).
    excess = []
    for width in (4.0, 2.0, 1.0):
        part, force = portal(width)
        sway = linear(part, 2).displacement[[2, 3], 0].mean()
        bending = RUBBER.young * part.section.inertia
        excess.append(sway / (5.0 * force * LENGTH**3 / (84.0 * bending)) - 1.0)
    # What is left is stretching, which goes with the square of width over length.
    assert np.array(excess[:-1]) / excess[1:] == pytest.approx(4.0, rel=0.02)
    assert 0.0 < excess[-1] < 3e-4


def elastica(load: float) -> tuple[float, float, float]:
    """Tip of an inextensible cantilever under a dead force across it, load = P L^2 / E I.

    With psi the tip's angle, ds = d(theta) / sqrt(2 load (sin psi - sin theta)).
    """

    def integral(tip: float, weight) -> float:
        # theta = tip - s^2 takes the root's singularity away.
        def inner(s: float) -> float:
            gap = 2.0 * math.cos(tip - s * s / 2.0) * math.sin(s * s / 2.0)
            return weight(tip - s * s) * 2.0 * s / math.sqrt(2.0 * load * gap)

        return quad(inner, 0.0, math.sqrt(tip), epsabs=1e-13, epsrel=1e-12)[0]

    angle = brentq(lambda tip: integral(tip, lambda _: 1.0) - 1.0, 1e-3, 1.5707, xtol=1e-13)
    return 1.0 - integral(angle, math.cos), integral(angle, math.sin), angle


def test_a_long_cantilever_is_an_elastica_with_second_order_convergence() -> None:
    load = 10.0
    shorter, deflected, angle = elastica(load)
    assert (shorter, deflected, angle) == pytest.approx((0.55500, 0.81061, 1.43029), abs=2e-5)
    # A bar stretches a little, the elastica does not: the more slender, the less.
    force = load * RUBBER.young * SLENDER.inertia / LENGTH**2
    part = chain(force, (0.0, 1.0), SLENDER)
    errors = []
    for elements in (8, 16, 32):
        ours = loaded(part, elements).displacement[2]
        exact = np.array([-shorter * LENGTH, deflected * LENGTH, angle])
        errors.append(np.abs(ours - exact).max() / LENGTH)
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx(2.0, abs=0.15)
    assert errors[-1] < 5e-4


def test_a_column_buckles_at_euler_s_load() -> None:
    critical = math.pi**2 * BENDING / (4.0 * LENGTH**2)
    paths = []
    for factor in (0.995, 1.02):
        part = chain(factor * critical, (-1.0, 0.0))
        paths.append(follow_path(FrameEquations(part_frame(part, 8))))
    assert [path.status for path in paths] == [PathStatus.CONVERGED, PathStatus.SNAPPED]
    assert paths[1].states[-1].load * 1.02 == pytest.approx(1.0, rel=2e-3)
    assert paths[1].loss is StabilityLoss.BIFURCATION


def lee_frame(elements: int, drive: str) -> PartFrame:
    """A column and a bar of equal length, hinged at both far ends, pushed down at a fifth."""
    lattice = Lattice([[0.0, 0.0], [0.0, 1.0], [0.2, 1.0], [1.0, 1.0]], [[0, 1], [1, 2], [2, 3]])
    problem = Problem(
        name="lee",
        lattice=lattice,
        supports=Supports(fixed=[0, 3]),
        input=Input(nodes=[2], direction=[0.0, -1.0], drive=drive, amount=0.5),
        output=Output(nodes=[1], direction=[1.0, 0.0]),
        designable=[0],
    )
    steel = Material(name="as in the literature", young=72e3, poisson=0.3)
    part = Part(problem.full_design(), steel, Section(20.0, 30.0), scale=1200.0)
    if drive == "force":
        amount = 25e3 / (part.stiffness_unit * part.scale)
        driven = replace(problem, input=replace(problem.input, amount=amount))
        part = replace(part, design=driven.full_design())
    frame = part_frame(part, elements)
    held = frame.held.copy()
    held[[0, 3], 2] = False  # hinges
    held[2, 0] = False  # the pushed point slides sideways
    return replace(frame, held=held)


def test_lee_s_frame_snaps_at_its_limit_load() -> None:
    # Moved by the same point it does not snap yet, and needs most force where it would.
    moved = FrameEquations(lee_frame(12, "displacement"))
    path = follow_path(moved, StepControl(largest=1.0 / 64.0))
    assert path.status is PathStatus.CONVERGED
    limit = max(-moved.complete(state).reaction[2, 1] for state in path.states)
    path = follow_path(FrameEquations(lee_frame(12, "force")))
    assert (path.status, path.loss) == (PathStatus.SNAPPED, StabilityLoss.LIMIT_POINT)
    assert path.states[-1].load * 25e3 == pytest.approx(limit, rel=1e-3)


def test_an_output_spring_shares_the_load_with_the_bar() -> None:
    part = chain(1e-3, (1.0, 0.0))
    output = Output(nodes=[1], direction=[1.0, 0.0], spring=2.0)
    problem = replace(part.design.problem, output=output)
    part = replace(part, design=problem.full_design())
    state = linear(part, 2)
    bar = RUBBER.young * SECTION.area / (LENGTH / 2.0)
    spring = 2.0 * bar / (2.0 * problem.stiffness.bond)  # a beam has 2 k, its strut E A / L
    expected = 1e-3 / (bar + spring)
    assert state.displacement[1, 0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_residuals_are_the_gradient_of_the_energy_and_the_stiffness_theirs(theory: str) -> None:
    part = diluted("scaling-8", 4)
    equations = FrameEquations(part_frame(part, 2, theory))
    rng = np.random.default_rng(5)
    size = np.tile([0.5, 0.5, 0.3], equations.frame.held.size // 3)[equations.free]
    here, along = rng.uniform(-1.0, 1.0, (2, equations.count)) * [size, np.ones_like(size)]

    def stored(unknowns: np.ndarray, load: float = 0.3) -> float:
        state = equations.complete(PathState(load, unknowns))
        return energy(equations.frame, state)

    def residual(unknowns: np.ndarray, load: float = 0.3) -> np.ndarray:
        return equations.linearise(unknowns, load).residual

    step = 1e-5
    ahead, behind = here + step * along, here - step * along
    work = (stored(ahead) - stored(behind)) / (2.0 * step)
    assert residual(here) @ along == pytest.approx(work, rel=1e-6)
    change = (residual(ahead) - residual(behind)) / (2.0 * step)
    solved = equations.linearise(here, 0.3).stiffness.solve(change)
    assert solved == pytest.approx(along, rel=1e-4, abs=1e-5)
    change = (residual(here, 0.3 + step) - residual(here, 0.3 - step)) / (2.0 * step)
    scale = np.abs(change).max()
    assert equations.load_derivative(here, 0.3) == pytest.approx(change, abs=1e-7 * scale)


def test_a_loose_piece_makes_a_mechanism() -> None:
    crane = find_problem("crane")
    rim = crane.lattice.beams_touching(np.concatenate([crane.output.nodes, crane.input.nodes]))
    for loose in (rim, rim | ~np.isin(np.arange(len(rim)), crane.designable)):
        part = Part(Design(crane, loose), RUBBER, Section(2.0, 5.0))
        path = follow_path(FrameEquations(part_frame(part, 2)))
        assert path.status is PathStatus.MECHANISM
        assert [state.load for state in path.states] == [0.0]


@pytest.mark.parametrize("name", ["machine:crane", "machine:discs", "human:anti-parallel"])
@pytest.mark.parametrize("elements", [1, 8])
def test_validation_follows_the_same_path_as_the_frames_of_searches(
    name: str, elements: int
) -> None:
    design, spec = find_design(name), PartSpec()
    part = spec.of(design)
    expected = FrameEvaluator(frame_problem(design.problem, spec), elements=elements)
    response = expected.evaluate(design.mask)
    assert response.status.label == "converged"
    moved = loaded(part, elements).displacement[: len(part.positions), :2] / part.scale
    used = np.unique(part.struts)
    assert moved[used] == pytest.approx(response.displacement[used], abs=1e-8)
    last = levels["frame"](part, FemSettings(elements=elements)).last
    assert last.efficiency == pytest.approx(response.efficiency, rel=1e-8)
    force = expected.strain().input_forces.sum(axis=0) * part.stiffness_unit * part.scale
    assert last.force == pytest.approx(force, rel=1e-6)
    energy_unit = part.stiffness_unit * part.scale**2
    assert last.energy == pytest.approx(energy_unit * response.energy, rel=1e-8)


def test_a_path_of_slender_struts_does_not_jump_where_they_buckle() -> None:
    """Full lattice, struts 0.8 mm wide on 10 mm: a jump to another branch changes it by 0.6 %."""
    problem, spec = find_problem("scaling-12"), PartSpec(width=0.8)
    framed = frame_problem(problem, spec)
    mask = clean(framed.full_design()).mask
    response = FrameEvaluator(framed, elements=8).evaluate(mask, 1.0 / 128.0)
    analysis = levels["frame"](spec.of(Design(problem, mask)), FemSettings())
    assert analysis.status.value == response.status.label == "converged"
    assert analysis.efficiency == pytest.approx(response.efficiency, rel=1e-6)
