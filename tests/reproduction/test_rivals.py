from __future__ import annotations

import sys

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.machines.library.tasks import straight_motion
from reproduction.boxes import TASKS, box_of
from reproduction.outline_analysis import analyse_outline, contour_of, drawing, polygon_of
from reproduction.straight_lift import PAYLOAD, scored
from reproduction.topology import optimise, pymoto


@pytest.mark.parametrize("name", TASKS)
def test_ports_of_a_box_face_each_other_and_the_gap_is_empty(name: str) -> None:
    box = box_of(name, 6, 7, 0.2, 0.01)
    problem = box.problem
    places = problem.lattice.positions
    assert places[problem.input.nodes, 0].max() == 0.0
    assert places[problem.output.nodes, 0].min() >= places[:, 0].max() - 0.5
    absent = np.flatnonzero(~problem.initial)
    assert (name == "gripper") == bool(len(absent))
    assert not np.isin(absent, problem.designable).any()


def test_a_contour_has_the_given_area_and_contains_all_ports() -> None:
    box = box_of("inverter", 6, 7, 0.2, 0.01)
    rows, columns = 54, 62
    up, across = np.linspace(-1.0, 1.0, rows)[:, None], np.linspace(-1.0, 1.0, columns)
    density = 0.95 - 0.9 * np.exp(-4.0 * (up**2 + across**2))
    size = float(np.prod(box.high - box.low))
    shape = contour_of(box, density, 0.9 * size)
    assert shape is not None
    assert shape.area == pytest.approx(0.9 * size, rel=0.01)
    assert len(shape.interiors) == 1


def test_boundary_curves_follow_the_edge_of_the_mesh() -> None:
    rest = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    curves = drawing(rest, np.ones((4, 2)), np.array([[0, 1, 2], [0, 2, 3]]))
    assert len(curves) == 1
    corners = np.array(curves[0])
    assert {tuple(each) for each in corners[:, :2].tolist()} == {
        (0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)
    }  # fmt: skip
    assert (corners[:, 2:] - corners[:, :2] == 1.0).all()


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymoto", None)
    with pytest.raises(InvalidSettings, match=r"pip install 'bellcrank\[rivals\]'"):
        pymoto()


@pytest.mark.slow
def test_topology_optimisation_finds_an_inverter() -> None:
    try:
        pymoto()
    except InvalidSettings:
        pytest.skip("pyMOTO is not installed")
    box = box_of("inverter", 4, 7, 0.2, 0.01)
    result = optimise(box, 26, 0.4, (0.1, 0.01), 1.5, 25)
    assert result["output_over_input"] > 0.3


@pytest.mark.slow
def test_the_analysis_of_an_outline_agrees_with_plane_validation() -> None:
    pytest.importorskip("ngsolve")
    from bellcrank.fem import FemSettings
    from bellcrank.fem.levels import levels

    box = box_of("inverter", 4, 3, 0.05, 0.01)
    part = box.spec.of(box.problem.full_design())
    result = analyse_outline(box, part, polygon_of(part), 2.0, "neo-hookean")
    known = levels["plane"](part, FemSettings(size=2.0))
    assert result["status"] == "converged"
    assert result["efficiency"] == pytest.approx(known.efficiency, abs=0.02)
    assert result["input_force_N"] == pytest.approx(known.last.push, rel=0.02)


@pytest.mark.slow
def test_topology_optimisation_limits_the_motion_across_the_output() -> None:
    try:
        pymoto()
    except InvalidSettings:
        pytest.skip("pyMOTO is not installed")
    box = box_of("lift", 6, 7, 0.2, None)
    free = optimise(box, 26, 0.4, (0.1, 0.01), 1.5, 25)
    straight = optimise(box, 26, 0.4, (0.1, 0.01), 1.5, 25, 0.05)
    assert free["across_over_output"] > 0.1
    assert straight["across_over_output"] < 0.07


@pytest.mark.slow
def test_the_items_of_an_outline_are_those_of_its_struts() -> None:
    pytest.importorskip("ngsolve")
    from bellcrank.fem.specification import sheet_items

    box = box_of("lift", 4, 3, 0.05, None)
    problem = straight_motion(box.problem, PAYLOAD, box.spec)
    part = box.spec.of(problem.full_design())
    known = {item.item.quantity: item for item in sheet_items(part, 1.0) or ()}
    found = scored(box, polygon_of(part), 1.0)["items"]
    assert [item["quantity"] for item in found] == [
        "gain", "off_axis", "rotation", "sag", "payload", "strain"
    ]  # fmt: skip
    values = {item["quantity"]: item["value"] for item in found}
    # The full lattice hardly moves its output up, so that parts of the travel are compared as
    # motions.
    for name in ("gain", "rotation", "off_axis", "sag"):
        travels = values["gain"], known["gain"].value
        one, other = travels if name in ("off_axis", "sag") else (1.0, 1.0)
        assert values[name] * one == pytest.approx(known[name].value * other, rel=0.05, abs=1e-3)
