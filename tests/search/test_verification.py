"""Frames as the model of a search: goals, cleaning, verification with more elements."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    FrameEvaluator,
    ItemResult,
    Status,
    at_fraction,
    model_evaluator,
)
from bellcrank.model import (
    Design,
    Input,
    Item,
    Lattice,
    Output,
    Problem,
    Section,
    Supports,
    find_problem,
    pack_mask,
    read_problem,
    unpack_mask,
)
from bellcrank.part import PartSpec, frame_problem, spring_problem
from bellcrank.search import (
    BLOCK,
    Candidate,
    Finalist,
    HoppingSettings,
    MetropolisSettings,
    Verdict,
    advance_chain,
    chain_blocks,
    clean,
    is_done,
    make_evaluator,
    read_settings,
    read_state,
    select,
    start_chain,
    verification_evaluator,
)
from bellcrank.search.choice import FirstWithoutFault, shortlist
from bellcrank.search.constraints import ConstrainedEvaluator, LoadCase, constraints
from bellcrank.search.verification import Verifier
from tests.reference3d import read_reference
from tests.search.test_constraints import EVERY_GOAL

if TYPE_CHECKING:
    from pathlib import Path

LIFT = """
schema = "bellcrank/problem/1"
name = "lift"
[lattice]
kind = "triangular-rows"
counts = [8, 9, 8, 9, 8, 9]
first_x = [0.5, 0.0, 0.5, 0.0, 0.5, 0.0]
[supports]
fixed = [{ row = 0 }]
[input]
nodes = [{ row = -1, rightmost = 2 }]
direction = [0, -1]
drive = "displacement"
amount = 0.2
[output]
nodes = [{ row = -1, leftmost = 2 }]
direction = [0, 1]
"""
TURNS_OVER = "fffff1ffaf21f4acda0d83d1fdd47ff8"
"""Its struts run into each other."""
WORKS = "ffffff492db1d814dfec03f3e6c47ff8"
"""Efficiency 12.5 as a frame."""
SPEC = PartSpec(width=2.0)


@pytest.fixture(scope="module")
def lift(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    path: Path = tmp_path_factory.mktemp("lift") / "lift.toml"
    path.write_text(LIFT)
    return frame_problem(read_problem(path), SPEC)


@pytest.fixture(scope="module")
def small() -> Problem:
    return frame_problem(find_problem("scaling-8"), SPEC)


def candidate(problem: Problem, mask: str, chain: int = 0) -> Candidate:
    bits = unpack_mask(mask, problem.lattice.beam_count)
    return Candidate(0.0, chain, 0, np.packbits(bits).tobytes())


def column(amount: float) -> Problem:
    """A column that is clamped below, compressed and free to rotate above, with an output arm."""
    return Problem(
        name="column",
        lattice=Lattice([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]], [[0, 1], [1, 2]]),
        supports=Supports(fixed=[0]),
        input=Input(nodes=[1], direction=[0.0, -1.0], drive="displacement", amount=amount),
        output=Output(nodes=[2], direction=[0.0, -1.0]),
        designable=[1],
        section=Section(0.1, 0.3),
    )


# ---- evaluators


def test_a_problem_with_a_section_is_searched_as_a_frame(small: Problem) -> None:
    assert isinstance(make_evaluator(small, HoppingSettings()), FrameEvaluator)
    constrained = make_evaluator(small, HoppingSettings(goals=("connected",)))
    assert isinstance(constrained, ConstrainedEvaluator)
    assert isinstance(constrained.evaluators[0], FrameEvaluator)
    assert not isinstance(make_evaluator(spring_problem(small), HoppingSettings()), FrameEvaluator)


@pytest.mark.parametrize("search", ["basin-hopping", "paper", "tempering"])
def test_every_search_runs_on_frames(small: Problem, search: str) -> None:
    settings = read_settings({"search": search, "steps": BLOCK})
    evaluator = make_evaluator(small, settings)
    [(state, rows)] = chain_blocks(evaluator, settings, 0)
    assert state.accepted > 5
    best = int(np.argmax(np.where(rows.accepted, rows.efficiency, -np.inf)))
    bits = np.unpackbits(rows.mask[best])[: small.lattice.beam_count].astype(bool)
    fresh = FrameEvaluator(small).evaluate(bits)
    assert fresh.efficiency == pytest.approx(rows.efficiency[best], abs=1e-7)


@pytest.mark.parametrize("search", ["basin-hopping", "paper", "tempering"])
def test_chains_of_frames_are_resumed_to_the_last_bit(small: Problem, search: str) -> None:
    settings = read_settings({"search": search, "steps": 2 * BLOCK, "seed": 2})
    whole = [rows for _, rows in chain_blocks(make_evaluator(small, settings), settings, 0)]
    state, parts = start_chain(make_evaluator(small, settings), settings), []
    while not is_done(state, settings):
        stored = read_state(settings, json.loads(json.dumps(state.to_dict())))
        state, rows = advance_chain(make_evaluator(small, settings), settings, 0, stored)
        parts.append(rows)
    for one, other in zip(whole, parts, strict=True):
        for first, second in zip(one, other, strict=True):
            np.testing.assert_array_equal(first, second)


def test_the_mean_over_strokes_is_that_of_frames(small: Problem) -> None:
    settings = HoppingSettings(strokes=(0.5, 1.0))
    mean = make_evaluator(small, settings, elements=8).evaluate(small.initial)
    parts = [
        FrameEvaluator(at_fraction(small, stroke), elements=8).evaluate(small.initial)
        for stroke in (0.5, 1.0)
    ]
    expected = np.mean([part.efficiency for part in parts])
    assert mean.efficiency == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("search", ["basin-hopping", "paper"])
def test_frames_are_searched_in_space(search: str) -> None:
    problem, _ = read_reference("octet-crane")
    settings = read_settings({"search": search, "steps": 20, "goals": ["mass <= 0.99"]})
    [(state, rows)] = chain_blocks(make_evaluator(problem, settings), settings, 0)
    assert state.step == len(rows.status) == 20
    assert rows.accepted.any()


# ---- goals


@pytest.mark.parametrize("goal", EVERY_GOAL.values(), ids=list(EVERY_GOAL))
def test_every_goal_is_measured_for_frames(small: Problem, goal: str) -> None:
    evaluator = ConstrainedEvaluator([LoadCase(small)], [goal])
    response = evaluator.evaluate(small.initial, VERIFICATION_INCREMENT)
    assert response.status in {Status.CONVERGED, Verdict.UNMET}
    assert response.efficiency == pytest.approx(
        FrameEvaluator(small).evaluate(small.initial).efficiency, abs=1e-9
    )
    mask = small.initial.copy()
    mask[small.designable[3]] = False
    evaluator.set_reference()
    evaluator.predict_flips(small.initial)
    assert evaluator.evaluate(mask, warm_start=True).status in set(Verdict) | set(Status)


def test_every_registered_goal_is_tried() -> None:
    assert set(EVERY_GOAL) == set(constraints)


def test_mirror_images_in_space_need_a_symmetric_lattice(small: Problem) -> None:
    problem, _ = read_reference("octet-crane")
    with pytest.raises(InvalidSettings, match=r"goal .mirror x.: .* is not symmetric in x"):
        ConstrainedEvaluator([LoadCase(problem)], ["mirror x"])
    with pytest.raises(InvalidSettings, match=r"goal .mirror z.: .* is in the plane"):
        ConstrainedEvaluator([LoadCase(small)], ["mirror z"])


def test_a_search_of_frames_satisfies_its_goals(small: Problem) -> None:
    goals = ("mass <= 0.7", "strain <= 0.2", "stiffness >= 0.01")
    settings = HoppingSettings(steps=2 * BLOCK, goals=goals)
    masks = []
    for _, rows in chain_blocks(make_evaluator(small, settings), settings, 0):
        taken = rows.accepted & (rows.status == Status.CONVERGED)
        masks.extend(rows.mask[taken])
    assert len(masks) > 3
    verifier = verification_evaluator(small, settings)
    bits = np.unpackbits(masks[-1])[: small.lattice.beam_count].astype(bool)
    assert isinstance(verifier, ConstrainedEvaluator)
    assert verifier.violated(bits) == []
    strict = ConstrainedEvaluator([LoadCase(small)], ["stiffness >= 1000"], elements=8)
    assert strict.violated(bits) == ["stiffness >= 1000"]


# ---- quantities


@pytest.mark.parametrize("elements", [1, 8])
def test_stiffness_strain_and_energy_of_a_cantilever(elements: int) -> None:
    force, section = 1e-9, Section(0.1, 0.3)
    problem = Problem(
        name="cantilever",
        lattice=Lattice([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [[0, 1], [1, 2]]),
        supports=Supports(fixed=[0]),
        input=Input(nodes=[2], direction=[0.0, 1.0], drive="force", amount=force),
        output=Output(nodes=[1], direction=[0.0, 1.0]),
        designable=[1],
        section=section,
    )
    evaluator = model_evaluator(problem, elements=elements)
    response = evaluator.evaluate([True, True])
    rigidity = section.inertia
    assert evaluator.output_stiffness() == pytest.approx(3.0 * rigidity, rel=1e-6)
    # E = 1; the moment at the support is F times the length.
    bent = force * 2.0 * 0.05 / rigidity
    assert evaluator.largest_strain() == pytest.approx(bent, rel=1e-3)
    strain = evaluator.strain()
    assert strain.energy.sum() == pytest.approx(response.energy, rel=1e-9)
    assert strain.energy.sum() == pytest.approx(force**2 * 2.0**3 / (6.0 * rigidity), rel=1e-6)
    assert strain.input_forces.tolist() == [[0.0, force]]
    assert strain.input_force == pytest.approx(force)


@pytest.mark.parametrize("name", ["planar-crane", "octet-crane", "octet-twist"])
@pytest.mark.parametrize("elements", [None, 1, 2])
def test_energies_of_beams_add_up(name: str, elements: int | None) -> None:
    problem, data = read_reference(name)
    mask = unpack_mask(data["results"][10]["mask"], problem.lattice.beam_count)
    evaluator = model_evaluator(problem, elements=elements)
    response = evaluator.evaluate(mask)
    energy = evaluator.strain().energy
    assert not energy[~mask].any()
    assert energy.sum() == pytest.approx(response.energy, rel=1e-9)


# ---- cleaning


@pytest.mark.parametrize("seed", range(3))
def test_cleaning_a_frame_removes_what_carries_no_load(small: Problem, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = small.initial.copy()
    mask[rng.choice(small.designable, 110, replace=False)] = False
    cleaned = clean(Design(small, mask)).mask
    expected = clean(Design(spring_problem(small), mask)).mask
    assert np.array_equal(cleaned, expected)
    evaluator = FrameEvaluator(small)
    before, after = (evaluator.evaluate(each, VERIFICATION_INCREMENT) for each in (mask, cleaned))
    assert before.status is after.status
    if before.status is Status.CONVERGED:
        assert after.efficiency == pytest.approx(before.efficiency, abs=1e-8)


# ---- verification


def test_a_column_that_buckles_between_its_ends_has_a_fault() -> None:
    # The column buckles at a strain of 20.19 I / (A L^2) = 0.0168; one element does so at 0.025.
    problem = column(0.02)
    assert FrameEvaluator(problem).evaluate([True, True]).status is Status.CONVERGED
    found = Verifier(problem, HoppingSettings()).verify(np.array([True, True]))
    assert not found.is_stable
    assert found.fault == "snapped with 8 elements in each beam"
    assert Verifier(column(0.012), HoppingSettings()).verify(np.array([True, True])).fault is None


def test_faults_are_named(lift: Problem) -> None:
    mask = unpack_mask(WORKS, lift.lattice.beam_count)
    assert Verifier(lift, HoppingSettings(), strain_limit=0.65).verify(mask).fault is None
    brittle = Verifier(lift, HoppingSettings(), strain_limit=0.029).verify(mask)
    assert brittle.fault == "strain above the limit of the material"
    assert brittle.strain > 0.029
    bound = Verifier(lift, HoppingSettings(goals=("mass <= 0.3",))).verify(mask)
    assert bound.fault == "violates mass <= 0.3 with 8 elements in each beam"
    back = replace(lift, output=replace(lift.output, direction=-lift.output.direction))
    wrong = Verifier(back, HoppingSettings()).verify(mask)
    assert wrong.fault == "moves the wrong way with 8 elements in each beam"
    loose = replace(lift, supports=Supports(fixed_x=lift.supports.fixed))
    held = np.isin(lift.lattice.beams, lift.supports.fixed).any(axis=1)
    assert Verifier(loose, HoppingSettings()).verify(~held).fault == "held by no support"


def test_the_most_efficient_design_without_a_fault_is_selected(lift: Problem) -> None:
    candidates = [candidate(lift, mask) for mask in (TURNS_OVER, WORKS)]
    settings = HoppingSettings()
    reported: list[tuple[int, int]] = []
    verifier = Verifier(lift, settings)
    turned = unpack_mask(TURNS_OVER, lift.lattice.beam_count)
    fault = verifier.verify(turned).fault
    assert fault is not None
    choose = FirstWithoutFault(verifier, lambda done, total: reported.append((done, total)))
    selection = select(lift, candidates, evaluator=FrameEvaluator(lift), choose=choose)
    assert selection.design.mask_hex == WORKS
    assert selection.verification is not None
    assert selection.verification.fault is None
    assert selection.efficiency_after == pytest.approx(11.5, abs=0.1)
    assert reported


def finalist(problem: Problem, mask: str, chain: int = 0) -> Finalist:
    design = Design(problem, unpack_mask(mask, problem.lattice.beam_count))
    response = FrameEvaluator(problem).evaluate(design.mask, VERIFICATION_INCREMENT)
    return Finalist(candidate(problem, mask, chain), design, response)


def test_faults_of_more_efficient_designs_are_reported(lift: Problem) -> None:
    works, full = finalist(lift, WORKS), finalist(lift, pack_mask(lift.initial))
    brittle = Verifier(lift, HoppingSettings(), strain_limit=0.08)
    assert brittle.verify(works.design.mask).fault is not None
    chosen, refused, *_ = FirstWithoutFault(brittle)([works, full])
    assert chosen.design is full.design
    assert refused == [(works.response.efficiency, "strain above the limit of the material")]


def test_where_every_design_has_a_fault_a_stable_one_is_selected() -> None:
    mask = pack_mask(np.array([True, True]))
    buckles, strained = finalist(column(0.02), mask), finalist(column(0.012), mask)
    verifiers = {0.02: Verifier(column(0.02), HoppingSettings())}
    chosen, refused, *_ = FirstWithoutFault(verifiers[0.02])([buckles])
    assert chosen.verification is not None
    assert refused == []
    limited = Verifier(column(0.012), HoppingSettings(), strain_limit=1e-4)
    chosen, *_ = FirstWithoutFault(limited)([strained])
    assert chosen.verification is not None
    assert chosen.verification.fault == "strain above the limit of the material"
    assert math.isfinite(chosen.verification.response.efficiency)


def test_each_chain_has_its_turn(lift: Problem) -> None:
    works = finalist(lift, WORKS)
    listed = [replace(works, found=replace(works.found, chain=chain)) for chain in (0,) * 90 + (1,)]
    chosen = shortlist(listed)
    assert len(chosen) == 48
    assert chosen[0] is listed[0]
    assert chosen[-1] is listed[-1]


def test_unmet_designs_of_each_chain_are_verified(lift: Problem) -> None:
    """A chain whose designs are worse in every item has its turn too."""
    works = finalist(lift, WORKS)
    item = Item(quantity="gain", case="case", output="output", at_least=2.0)

    def unmet(gain: float, chain: int) -> Finalist:
        response = replace(works.response, status=Verdict.UNMET)
        items = (ItemResult(item, gain, (2.0 - gain) / 2.0, 1.0),)
        return replace(
            works, found=replace(works.found, chain=chain), response=response, items=items
        )

    listed = [unmet(1.8, 0), unmet(1.5, 0), unmet(1.2, 1), unmet(1.1, 1)]
    assert shortlist(listed) == [listed[0], listed[2]]


def test_the_reserve_has_other_designs_that_differ_from_each_other(lift: Problem) -> None:
    item = Item(quantity="gain", case="case", output="output", at_least=2.0)
    items = (ItemResult(item, 1.0, 0.5, -0.5),)
    full, works = (
        replace(finalist(lift, mask), items=items) for mask in (pack_mask(lift.initial), WORKS)
    )
    mask = works.design.mask.copy()
    mask[np.flatnonzero(mask)[0]] = False
    nearly = replace(works, design=works.design.with_mask(mask))
    brittle = Verifier(lift, HoppingSettings(), strain_limit=0.08)
    found = FirstWithoutFault(brittle)([works, nearly, full])
    assert found.finalist.design is full.design
    assert found.others == []
    assert found.reserve == [works]


def test_designs_in_space_are_verified() -> None:
    problem, data = read_reference("octet-crane")
    mask = unpack_mask(data["results"][0]["mask"], problem.lattice.beam_count)
    found = Verifier(problem, MetropolisSettings()).verify(mask)
    assert found.fault is None
    assert found.response.efficiency == pytest.approx(data["results"][0]["efficiency"], abs=3e-4)
