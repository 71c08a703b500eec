from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem
from bellcrank.model import (
    Design,
    Input,
    ObjectiveTerm,
    Output,
    Stiffness,
    Supports,
    builtin,
    find_problem,
    problem_from_dict,
    problem_to_dict,
)
from bellcrank.model.specification import ONLY_BOUNDED


@pytest.fixture
def problem(small):
    return problem_from_dict(small)


def test_beams_at_supports_rollers_input_and_output_are_not_designable_by_default(small):
    del small["designable"]
    assert problem_from_dict(small | {"supports": {"fixed": [0]}}).designable.tolist() == [2, 3, 4]
    assert problem_from_dict(small).designable.tolist() == [3]


def test_all_beams_are_present_by_default(small):
    del small["initial"]
    assert problem_from_dict(small).full_design().beam_count == 8


def test_the_full_design_has_the_initial_beams(small):
    design = problem_from_dict(small | {"initial": "f7"}).full_design()
    assert design.mask.tolist() == [True] * 4 + [False] + [True] * 3
    assert design.mask_hex == "f7"


def test_a_node_held_in_x_and_in_y_is_fixed_in_the_plane():
    supports = Supports(fixed=[5], fixed_x=[3, 1, 5], fixed_y=[3]).merged(2)
    assert supports.fixed.tolist() == [3, 5]
    assert supports.fixed_x.tolist() == [1]
    assert supports.fixed_y.tolist() == []
    assert supports.nodes.tolist() == [1, 3, 5]


def test_one_direction_serves_all_nodes():
    watched = Output(nodes=[4, 2, 7], direction=[0.6, 0.8])
    assert watched.direction.tolist() == [[0.6, 0.8]] * 3


def test_nearly_unit_directions_become_unit_and_then_stay_as_they_are():
    first = Output(nodes=[0], direction=[0.6000001, 0.8000001]).direction
    assert np.linalg.norm(first) == pytest.approx(1.0, abs=1e-15)
    assert (Output(nodes=[0], direction=first).direction == first).all()


def test_a_spring_is_directional_unless_said_otherwise():
    assert Output([0], [1, 0], spring=2).spring_kind == "directional"
    assert Output([0], [1, 0], spring=2, spring_kind="isotropic").spring_kind == "isotropic"
    assert Output([0], [1, 0]).spring_kind is None


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Stiffness(bond=0.0), "stiffness.bond: expected a number greater than 0, got 0.0"),
        (lambda: Stiffness(angle=float("nan")), "stiffness.angle: expected a finite number"),
        (lambda: Supports(fixed=[1, 2, 1]), r"supports.fixed\[2\]: 1 is listed twice"),
        (lambda: Supports(fixed=[[1, 2]]), "supports.fixed: expected a flat list"),
        (lambda: Input([], [0, 1], "force", 1.0), "input.nodes: expected at least one node"),
        (lambda: Input([1, 1], [0, 1], "force", 1.0), r"input.nodes\[1\]: 1 is listed twice"),
        (lambda: Input([1], [0, 1], "pull", 1.0), "input.drive: expected .* got 'pull'"),
        (lambda: Input([1], [0, 1], "force", -1.0), "input.amount: expected .* greater than 0"),
        (lambda: Input([1], [0, 2], "force", 1.0), r"expected unit vectors, got \[0.0, 2.0\]"),
        (lambda: Input([1], [0, 0], "force", 1.0), r"expected unit vectors, got \[0.0, 0.0\]"),
        (
            lambda: Input([1, 2], [[0, 1]] * 3, "force", 1.0),
            r"shape \(2, 2\), .* got shape \(3, 2\)",
        ),
        (lambda: Output([1], [1]), r"output.direction: .* got shape \(1,\)"),
        (lambda: Output([1], [1, 0, 0, 0]), r"output.direction: .* got shape \(4,\)"),
        (lambda: Output([1], [0, 1], spring=0.0), "output.spring: expected .* greater than 0"),
        (lambda: Output([1], [0, 1], 1.0, "stiff"), "output.spring_kind: expected .* got 'stiff'"),
        (lambda: Output([1], [0, 1], None, "isotropic"), "given without output.spring"),
    ],
)
def test_impossible_conditions_are_refused(build, message):
    with pytest.raises(InvalidProblem, match=message):
        build()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": " "}, "name: expected some text"),
        ({"aggregate": "median"}, "aggregate: expected 'mean' or 'sum', got 'median'"),
        ({"objective": ""}, "objective: expected a name, got ''"),
        ({"initial": [True]}, r"initial: expected one boolean per beam, shape \(8,\)"),
        ({"initial": [1] * 8}, "initial: expected booleans, got values of type int64"),
        ({"designable": []}, "designable: no beam is left to design"),
        ({"designable": [2, 8]}, r"designable\[1\]: expected a beam from 0 to 7, got 8"),
        ({"designable": [2, 2]}, r"designable\[1\]: 2 is listed twice"),
        ({"supports": Supports(fixed=[6])}, r"supports.fixed\[0\]: expected a node from 0 to 5"),
        ({"supports": Supports(fixed=[5])}, "input.nodes: node 5 is also in supports.fixed"),
        ({"supports": Supports(fixed_x=[4])}, "output.nodes: node 4 is also in supports.fixed_x"),
        ({"output": Output([5], [1, 0])}, "output.nodes: node 5 is also in input.nodes"),
    ],
)
def test_impossible_problems_are_refused(problem, change, message):
    with pytest.raises(InvalidProblem, match=message):
        replace(problem, **change)


def test_an_output_that_no_beam_joins_to_the_input_is_refused(small):
    small["beams"] = [[0, 1], [0, 2], [1, 3], [2, 3], [1, 2], [2, 4]]
    del small["initial"], small["designable"]
    with pytest.raises(InvalidProblem, match=r"output.nodes: node 4.* not connected"):
        problem_from_dict(small)


def test_problems_cannot_be_changed(problem):
    with pytest.raises(FrozenInstanceError):
        problem.name = "other"
    with pytest.raises(ValueError, match="read-only"):
        problem.initial[0] = False


def test_equal_problems_have_equal_hashes_and_others_do_not(problem):
    assert replace(problem).hash == problem.hash
    assert pickle.loads(pickle.dumps(problem)).hash == problem.hash
    assert replace(problem, stiffness=Stiffness(bond=6.0)).hash != problem.hash
    assert replace(problem, objective="displacement").hash != problem.hash


def test_the_sign_of_zero_does_not_change_a_hash(problem, small):
    small["positions"][0] = [-0.0, 0.0]
    assert problem_from_dict(small).hash == problem.hash


@pytest.mark.parametrize("name", builtin.names())
def test_a_problem_survives_being_written_out(name):
    problem = builtin[name]()
    assert problem_from_dict(problem_to_dict(problem)).hash == problem.hash


def test_an_objective_is_written_only_if_there_is_one(problem):
    assert "objective" not in problem_to_dict(problem)
    assert problem_to_dict(replace(problem, objective="force"))["objective"] == "force"


def test_another_mask_forgets_the_efficiency_but_not_where_it_came_from():
    problem = find_problem("scaling-8")
    design = replace(problem.full_design(), efficiency=1.5, provenance={"seed": 7})
    mask = design.mask.copy()
    mask[0] = False
    other = design.with_mask(mask)
    assert other.beam_count == design.beam_count - 1
    assert other.efficiency is None
    assert other.provenance == {"seed": 7}


def test_a_design_keeps_its_own_provenance(problem):
    history = {"steps": [1, 2]}
    design = Design(problem, problem.initial, provenance=history)
    history["steps"].append(3)
    assert design.provenance == {"steps": [1, 2]}


def test_designs_travel_between_processes(problem):
    design = Design(problem, problem.initial, efficiency=0.5)
    again = pickle.loads(pickle.dumps(design))
    assert again.mask_hex == design.mask_hex
    assert not again.mask.flags.writeable


@pytest.mark.parametrize(
    ("mask", "efficiency", "message"),
    [
        (np.ones(7, dtype=bool), None, r"mask: expected .* shape \(8,\), got shape \(7,\)"),
        (np.ones(8), None, "mask: expected booleans, got values of type float64"),
        (np.ones(8, dtype=bool), float("nan"), "efficiency: expected a finite number"),
    ],
)
def test_impossible_designs_are_refused(problem, mask, efficiency, message):
    with pytest.raises(InvalidProblem, match=message):
        Design(problem, mask, efficiency)


@pytest.mark.parametrize("quantity", ONLY_BOUNDED)
def test_quantities_without_a_value_along_the_stroke_are_no_objectives(quantity):
    with pytest.raises(InvalidProblem, match=f"{quantity}: expected a bound, not an objective"):
        ObjectiveTerm(quantity=quantity, case="case")
