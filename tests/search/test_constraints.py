"""Each constraint on designs made by hand, with the violation it must measure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.machines import mean_ports, two_port_at
from bellcrank.mechanics import (
    Core,
    SpringEvaluator,
    Status,
    near_pairs,
    output_stiffness,
    predict_output_stiffness,
)
from bellcrank.model import Input, Lattice, Output, Problem, Supports, find_problem
from bellcrank.search.constraints import (
    ConstrainedEvaluator,
    DeformedDesign,
    LoadCase,
    constraints,
    mass_of,
    parse_goal,
)
from bellcrank.search.symmetry import beam_images

EVERY_GOAL = {
    "mass": "mass <= 0.5",
    "degree": "degree >= 2",
    "connected": "connected",
    "mirror": "mirror x",
    "input-stiffness": "input-stiffness <= 0.1",
    "stiffness": "stiffness >= 0.1",
    "strain": "strain <= 0.1",
    "no-snapping": "no-snapping",
    "no-contact": "no-contact 0.1",
}


def ladder() -> Problem:
    """Two rows of four nodes, one above the other, with both diagonals in each square.

    The lower left node is held, the lower right one driven, the upper left one watched.
    """
    positions = [[x, y] for y in (0.0, 1.0) for x in range(4)]
    beams = [[i, i + 1] for i in (0, 1, 2, 4, 5, 6)]
    beams += [[i, i + 4] for i in range(4)]
    beams += [[i, i + 5] for i in range(3)] + [[i + 1, i + 4] for i in range(3)]
    return Problem(
        name="ladder",
        lattice=Lattice(positions, beams),
        supports=Supports(fixed=[0]),
        input=Input(nodes=[3], direction=[0.0, -1.0], drive="displacement", amount=0.1),
        output=Output(nodes=[4], direction=[-1.0, 0.0]),
        designable=list(range(len(beams))),
    )


def without(problem: Problem, *pairs: tuple[int, int]) -> np.ndarray:
    mask = problem.initial.copy()
    for pair in pairs:
        mask[(problem.lattice.beams == pair).all(axis=1)] = False
    return mask


def structure_violation(problem: Problem, text: str, mask: np.ndarray) -> float:
    measure = parse_goal(text).constraint(problem).structure_violation
    assert measure is not None
    return measure(mask, Core(SpringEvaluator(problem)).of(mask))


def moved(problem: Problem, mask: np.ndarray) -> DeformedDesign:
    evaluator = SpringEvaluator(problem)
    response = evaluator.evaluate(mask)
    assert response.status is Status.CONVERGED
    return DeformedDesign(evaluator, mask, Core(evaluator).of(mask), response)


def response_violation(text: str, state: DeformedDesign) -> float:
    measure = parse_goal(text).constraint(state.evaluator.problem).response_violation
    assert measure is not None
    return measure(state)


def random_designs(problem: Problem, count: int, min_density: float = 0.6) -> list[np.ndarray]:
    rng = np.random.default_rng(5)
    designs = []
    for _ in range(count):
        mask = problem.initial.copy()
        mask[problem.designable] &= rng.random(len(problem.designable)) < rng.uniform(
            min_density, 1
        )
        designs.append(mask)
    return designs


def test_every_goal_is_tested_here() -> None:
    assert set(EVERY_GOAL) == set(constraints)
    for name, text in EVERY_GOAL.items():
        assert parse_goal(text).name == name


@pytest.mark.parametrize(
    "text",
    [
        "mass", "mass < 0.5", "mass <= x", "mass <= 0", "mass <= -1", "mass <= nan", "mass <= inf",
        "degree >= 2.5", "degree <= 2", "connected 3", "mirror", "mirror w", "no-contact -1",
        "stiffness <= 1", "strain >= 1", "no-snapping now",
    ],
)  # fmt: skip
def test_bad_syntax_names_the_goal_and_says_what_was_expected(text: str) -> None:
    name = text.split(maxsplit=1)[0]
    with pytest.raises(InvalidSettings, match=f"goal '{text}': expected '{name}"):
        parse_goal(text)


def test_an_unknown_goal_lists_the_known_ones() -> None:
    with pytest.raises(UnknownName, match=r"unknown goal 'weight'; known: .*no-contact, mass"):
        parse_goal("weight <= 3")
    with pytest.raises(InvalidSettings, match="expected a text"):
        parse_goal(3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mass <= 1", "expected a fraction below 1"),
        ("degree >= 7", "no node of problem 'crane' has more than 6 beams"),
        ("mirror x", "not symmetric in x: 9 of 203 designable beams have no designable image"),
    ],
)
def test_goals_that_make_no_sense_for_a_problem_say_why(text: str, message: str) -> None:
    with pytest.raises(InvalidSettings, match=f"goal '{text}': .*{message}"):
        ConstrainedEvaluator([LoadCase(find_problem("crane"))], [text])


def test_mass_is_the_length_that_carries_load() -> None:
    problem = ladder()
    full = 10.0 + 6.0 * np.sqrt(2.0)
    mask = without(problem, (0, 1), (1, 2))
    assert mass_of(problem, Core(SpringEvaluator(problem)).of(mask)) == pytest.approx(
        (full - 2) / full
    )
    assert structure_violation(problem, "mass <= 0.5", problem.initial) == pytest.approx(0.5)
    assert structure_violation(problem, "mass <= 0.5", mask) == pytest.approx(
        1 - 0.5 / ((full - 2) / full)
    )
    assert structure_violation(problem, "mass <= 0.95", mask) == 0.0


def test_dead_ends_have_no_mass() -> None:
    problem = ladder()
    # Node 5 keeps a single beam, down to node 1.
    cut = without(problem, (4, 5), (5, 6), (0, 5), (2, 5))
    gone = without(problem, (4, 5), (5, 6), (0, 5), (2, 5), (1, 5))
    core = Core(SpringEvaluator(problem))
    assert (core.of(cut) == core.of(gone)).all()


def test_the_predicted_change_of_mass_is_exact_for_beams_that_leave_no_dead_end() -> None:
    problem = ladder()
    constraint = parse_goal("mass <= 0.5").constraint(problem)
    core = Core(SpringEvaluator(problem))
    assert constraint.flip_change is not None
    predicted = constraint.flip_change(core.of(problem.initial))
    for beam in problem.designable:
        mask = problem.initial.copy()
        mask[beam] = False
        gained = structure_violation(problem, "mass <= 0.5", mask) - 0.5
        assert predicted[beam] == pytest.approx(gained)


def test_degree_counts_the_beams_that_free_nodes_lack() -> None:
    problem = ladder()
    # Free: 1, 2, 5, 6, 7. In the full ladder 1, 2, 5, 6 have five beams, the corner 7 three.
    assert structure_violation(problem, "degree >= 3", problem.initial) == 0.0
    assert structure_violation(problem, "degree >= 4", problem.initial) == pytest.approx(1 / 11)
    fewer = without(problem, (6, 7))
    assert structure_violation(problem, "degree >= 4", fewer) == pytest.approx(2 / 12)
    assert structure_violation(problem, "degree >= 2", fewer) == 0.0


def test_connected_counts_pieces_and_missing_regions() -> None:
    problem = ladder()
    assert structure_violation(problem, "connected", problem.initial) == 0.0
    # The output hangs on three beams: 0-4, 4-5, 1-4.
    cut = without(problem, (0, 4), (4, 5), (1, 4))
    assert structure_violation(problem, "connected", cut) == pytest.approx(1 / 2)
    nothing = np.zeros_like(problem.initial)
    assert structure_violation(problem, "connected", nothing) == pytest.approx(3 / 4)


def test_two_pieces_are_one_too_many() -> None:
    positions = [[0, 0], [1, 0], [0, 1], [1, 1], [0.5, 2], [5, 0], [6, 0], [5.5, 1]]
    beams = [[0, 2], [0, 3], [1, 3], [2, 3], [2, 4], [3, 4], [5, 7], [6, 7], [3, 7]]
    problem = Problem(
        name="two", lattice=Lattice(positions, beams), supports=Supports(fixed=[0, 1, 5, 6]),
        input=Input([4, 7], [0.0, -1.0], "displacement", 0.05), output=Output([2], [-1.0, 0.0]),
        designable=[1, 8],
    )  # fmt: skip
    apart = problem.initial.copy()
    apart[8] = False
    assert structure_violation(problem, "connected", problem.initial) == 0.0
    assert structure_violation(problem, "connected", apart) == pytest.approx(1 / 2)


def test_mirror_counts_the_beams_whose_image_differs() -> None:
    problem = find_problem("scaling-8")
    images = beam_images(problem, "x")
    assert (images[images] == np.arange(len(images))).all()
    lattice = problem.lattice
    middle = lattice.positions[lattice.beams].mean(axis=1)[problem.designable]
    assert np.allclose(middle[images, 1], middle[:, 1])
    assert np.allclose(middle[images, 0] + middle[:, 0], middle[0, 0] + middle[images[0], 0])
    pair = next(i for i, image in enumerate(images) if image != i)
    alone = next(i for i, image in enumerate(images) if image == i)
    mask = problem.initial.copy()
    mask[problem.designable[alone]] = False
    assert structure_violation(problem, "mirror x", mask) == 0.0
    mask[problem.designable[pair]] = False
    assert structure_violation(problem, "mirror x", mask) == pytest.approx(2 / len(images))


def test_images_tell_crossing_diagonals_apart() -> None:
    problem = ladder()
    images = beam_images(problem, "x")
    middle = np.flatnonzero((problem.lattice.beams == (1, 6)).all(axis=1))[0]
    other = np.flatnonzero((problem.lattice.beams == (2, 5)).all(axis=1))[0]
    assert images[middle] == other


@pytest.mark.parametrize("name", ["crane", "pliers", "discs"])
def test_output_stiffness_is_what_a_small_force_meets(name: str) -> None:
    problem = find_problem(name)
    rng = np.random.default_rng(1)
    mask = problem.initial.copy()
    mask[rng.choice(problem.designable, 15, replace=False)] = False
    evaluator = SpringEvaluator(problem)
    before = evaluator.evaluate(mask)
    assert before.status is Status.CONVERGED
    nodes, wanted = problem.output.nodes, problem.output.direction
    held = evaluator.structure.active[nodes] == 1
    stiffness = output_stiffness(evaluator)

    def output(force: float) -> float:
        """Mean motion of the output under an additional force shared by its nodes."""
        pushed = SpringEvaluator(problem)
        load = pushed.system.load.copy()
        load[nodes[held]] += force / held.sum() * wanted[held]
        pushed.system = replace(pushed.system, load=load)
        motion = pushed.evaluate(mask, 0.25).displacement[nodes[held]]
        return float((motion * wanted[held]).sum(axis=1).mean())

    force = 1e-4 * stiffness
    assert 2 * force / (output(force) - output(-force)) == pytest.approx(stiffness, rel=1e-5)


def test_a_loose_output_has_no_stiffness() -> None:
    problem = ladder()
    state = moved(problem, without(problem, (0, 4), (4, 5), (1, 4)))
    assert output_stiffness(state.evaluator) == 0.0
    assert response_violation("stiffness >= 0.1", state) == 1.0


def test_stiffness_falls_short_by_the_part_that_is_missing() -> None:
    problem = ladder()
    state = moved(problem, problem.initial)
    stiffness = output_stiffness(state.evaluator)
    assert response_violation(f"stiffness >= {4 * stiffness}", state) == pytest.approx(0.75)
    assert response_violation(f"stiffness >= {stiffness / 2}", state) == 0.0


@pytest.mark.slow
def test_input_stiffness_is_that_of_the_condensed_structure() -> None:
    crane = find_problem("crane")
    small = replace(crane, input=replace(crane.input, amount=1e-5))
    element = mean_ports(small.full_design())
    condensed = two_port_at(element, element.rest()).input_stiffness
    state = moved(small, small.initial)
    violation = response_violation(f"input-stiffness <= {condensed / 4}", state)
    assert violation == pytest.approx(0.75, rel=1e-4)
    assert response_violation(f"input-stiffness <= {condensed * 1.01}", state) == 0.0
    assert response_violation(f"input-stiffness >= {condensed / 1.01}", state) == 0.0
    assert response_violation(f"input-stiffness >= {condensed * 4}", state) == pytest.approx(
        0.75, rel=1e-4
    )


def test_input_stiffness_is_none_of_a_force() -> None:
    with pytest.raises(InvalidSettings, match="'input-stiffness <= 1': the input is driven by"):
        ConstrainedEvaluator([LoadCase(find_problem("pliers"))], ["input-stiffness <= 1"])


def test_strain_is_that_of_the_most_stretched_beam() -> None:
    problem = ladder()
    state = moved(problem, problem.initial)
    position = problem.lattice.positions + state.response.displacement
    worst = max(
        abs(np.linalg.norm(position[b] - position[a]) - r) / r
        for (a, b), r in zip(problem.lattice.beams, problem.lattice.rest_length, strict=True)
    )
    assert state.evaluator.largest_strain() == pytest.approx(worst, rel=1e-12)
    assert response_violation(f"strain <= {worst / 4}", state) == pytest.approx(0.75)
    assert response_violation(f"strain <= {worst * 1.01}", state) == 0.0


def sampled_distance(first: np.ndarray, second: np.ndarray, count: int = 400) -> float:
    part = np.linspace(0.0, 1.0, count)[:, None]
    a, b = (s[0] + part * (s[1] - s[0]) for s in (first, second))
    return float(np.linalg.norm(a[:, None] - b[None], axis=2).min())


def distance_of(first: np.ndarray, second: np.ndarray) -> float:
    """Return the distance of two segments (2, d), by the search for near struts."""
    _, (distance,) = near_pairs(np.vstack([first, second]), np.array([[0, 1], [2, 3]]), 1e9)
    return float(distance)


@pytest.mark.parametrize("dimension", [2, 3])
def test_distances_of_segments_match_points_sampled_along_them(dimension: int) -> None:
    rng = np.random.default_rng(2)
    first, second = rng.random((2, 300, 2, dimension))
    distance = np.array([distance_of(a, b) for a, b in zip(first, second, strict=True)])
    assert ((distance == 0.0).sum() > 30) == (dimension == 2)
    for a, b, d in zip(first, second, distance, strict=True):
        assert sampled_distance(a, b) == pytest.approx(d, abs=1e-2)


def test_distances_of_parallel_and_touching_segments() -> None:
    bar = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    assert distance_of(bar, bar + np.array([0.5, 0.3, 0.4])) == pytest.approx(0.5)
    assert distance_of(bar, bar[::-1] + np.array([5.0, 0.0, 4.0])) == pytest.approx(5.0)
    assert distance_of(bar, np.array([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0]])) == 0.0
    assert distance_of(bar, np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])) == 0.0
    assert distance_of(bar, np.array([[3.0, 0.0, 1.0], [3.0, 0.0, -1.0]])) == pytest.approx(1.0)


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    "width", [pytest.param(0.0, marks=SLOW), 0.3, pytest.param(0.9, marks=SLOW)]
)
def test_near_struts_are_those_that_a_search_over_all_pairs_finds(width: float) -> None:
    problem = find_problem("crane")
    rng = np.random.default_rng(4)
    beams = problem.lattice.beams
    position = problem.lattice.positions + rng.normal(0.0, 0.25, problem.lattice.positions.shape)
    ends = position[beams]
    expected = {}
    for i in range(len(beams)):
        for j in range(i):
            if not set(beams[i].tolist()) & set(beams[j].tolist()):
                distance = distance_of(ends[i], ends[j])
                if distance < width or distance == 0.0:
                    expected[frozenset((i, j))] = distance
    pairs, distance = near_pairs(position, beams, width)
    found = {frozenset(p): d for p, d in zip(pairs.tolist(), distance, strict=True)}
    assert len(expected) > 10
    assert found == pytest.approx(expected)


def test_contact_counts_crossings_and_what_is_missing_of_the_width() -> None:
    # Two bars, the lower one pushed up by its driven ends until the gap is 0.2.
    positions = [[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [2, 1]]
    beams = [[0, 1], [2, 3], [1, 4], [3, 5], [4, 5]]
    problem = Problem(
        name="bars", lattice=Lattice(positions, beams), supports=Supports(fixed=[2, 3, 4]),
        input=Input([0, 1], [0.0, 1.0], "displacement", 0.8), output=Output([5], [1.0, 0.0]),
        designable=[2],
    )  # fmt: skip
    evaluator = SpringEvaluator(problem)
    displacement = np.zeros((6, 2))
    displacement[[0, 1], 1] = 0.8
    response = replace(evaluator.evaluate(problem.initial), displacement=displacement)
    mask = np.array([True, True, False, False, False])
    state = DeformedDesign(evaluator, mask, np.zeros(5, bool), response)
    assert response_violation("no-contact", state) == 0.0
    assert response_violation("no-contact 0.19", state) == 0.0
    assert response_violation("no-contact 0.4", state) == pytest.approx(0.5 / 1.5)
    # Held beams count although they carry nothing; absent ones do not.
    gone = replace(state, mask=np.zeros(5, bool))
    assert response_violation("no-contact 0.4", gone) == 0.0
    displacement[1, 1] = 1.2
    crossed = replace(state, response=replace(response, displacement=displacement))
    assert response_violation("no-contact", crossed) == pytest.approx(0.5)


def test_snapping_is_what_a_careful_path_finds() -> None:
    problem = find_problem("crane")
    careful = SpringEvaluator(problem)
    for mask in random_designs(problem, 15, min_density=0.4):
        evaluator = SpringEvaluator(problem)
        response = evaluator.evaluate(mask)
        state = DeformedDesign(evaluator, mask, Core(evaluator).of(mask), response)
        expected = careful.evaluate(mask, 1 / 32).status is not Status.CONVERGED
        assert response_violation("no-snapping", state) == expected


def test_the_core_is_that_of_the_evaluator() -> None:
    for name in ("crane", "pliers", "discs"):
        problem = find_problem(name)
        evaluator = SpringEvaluator(problem)
        core = Core(evaluator)
        for mask in random_designs(problem, 20, min_density=0.2):
            assert (core.of(mask) == evaluator.load_bearing(mask)).all()


@pytest.mark.parametrize("name", ["crane", "scaling-8", "pliers"])
def test_the_predicted_stiffness_ranks_flips_like_the_true_one(name: str) -> None:
    problem = find_problem(name)
    rng = np.random.default_rng(1)
    mask = problem.initial.copy()
    mask[problem.designable] &= rng.random(len(problem.designable)) < 0.85
    evaluator = SpringEvaluator(problem)
    assert evaluator.evaluate(mask).status is Status.CONVERGED
    before = output_stiffness(evaluator)
    evaluator.predict_flips(mask)
    beams = problem.designable[:: max(1, len(problem.designable) // 120)]
    predicted = predict_output_stiffness(evaluator, beams, mask[beams])
    real = []
    for beam in beams:
        flipped = mask.copy()
        flipped[beam] ^= True
        evaluator.evaluate(flipped)
        real.append(output_stiffness(evaluator))
    changes = np.array(real) - before, predicted - before
    assert spearmanr(*changes).statistic > 0.75
