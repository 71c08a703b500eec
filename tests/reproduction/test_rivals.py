from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.machines.library.tasks import straight_motion
from reproduction import topoptlab_peer
from reproduction.boxes import TASKS, box_of
from reproduction.outline_analysis import analyse_outline, contour_of, drawing, polygon_of
from reproduction.straight_lift import PAYLOAD, scored
from reproduction.topology import optimise, pymoto
from reproduction.topology_designs import packages

if TYPE_CHECKING:
    from pathlib import Path


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


STAND_IN = """
import json, sys
job = json.load(open(sys.argv[1]))
across, down = job["elements"]
density = [0.001 * (k + 1) for k in range(across * down)]
json.dump({"density": density, "seconds": 1.0}, open(sys.argv[2], "w"))
json.dump(job, open("KEPT", "w"))
"""
"""A program in place of topoptlab: densities that increase with the number of the element."""


def test_a_separate_program_gets_and_gives_elements_in_its_own_numbering(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    kept = tmp_path / "job.json"
    program = tmp_path / "program.py"
    program.write_text(STAND_IN.replace("KEPT", str(kept)))
    monkeypatch.setattr(topoptlab_peer, "PROGRAM", program)
    monkeypatch.setenv(topoptlab_peer.INTERPRETER, sys.executable)
    box = box_of("inverter", 6, 7, 0.2, 0.01)
    made = topoptlab_peer.optimise(box, 40, 0.4, (0.1, 0.01), 2.0, 5)
    density, (across, up) = np.array(made["density"]), made["elements"]
    assert density.shape == (up, across)
    # Columns from the left, each from the top; here rows are from the bottom.
    assert density[-1, 0] == 0.001
    assert density[-2, 0] == 0.002
    assert density[-1, 1] == pytest.approx(0.001 * (up + 1))
    job = json.loads(kept.read_text())
    load, output = np.array(job["load"]), np.array(job["output"])
    (push,), (pull,) = np.flatnonzero(load), np.flatnonzero(output)
    # The input is in the middle of the left side, the output in that of the right side.
    assert push % 2 == pull % 2 == 0
    for place, side in ((push, 0), (pull, across)):
        column, row = divmod(place // 2, up + 1)
        assert column == pytest.approx(side, abs=1)
        assert row == pytest.approx(0.5 * up, abs=1)
    assert load[push] == 1.0
    assert output[pull] == -1.0
    assert job["springs"] == [[push, pull], [0.1, 0.01]]
    rows = {place // 2 % (up + 1) for place in job["held"]}
    assert {min(rows), max(rows)} <= {0, 1, up - 1, up}


def test_an_interpreter_without_the_package_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(topoptlab_peer.INTERPRETER, raising=False)
    assert packages() == ("pyMOTO",)
    monkeypatch.setenv(topoptlab_peer.INTERPRETER, "/no/such/python")
    with pytest.raises(InvalidSettings, match="No such file"):
        packages()


@pytest.mark.slow
def test_topoptlab_finds_an_inverter() -> None:
    if topoptlab_peer.interpreter() is None:
        pytest.skip("no interpreter with topoptlab is given")
    box = box_of("inverter", 4, 7, 0.2, 0.01)
    made = topoptlab_peer.optimise(box, 26, 0.4, (0.1, 0.01), 1.5, 40)
    density = np.array(made["density"])
    assert density.mean() == pytest.approx(0.4, abs=0.02)
    shape = contour_of(box, density, 0.4 * float(np.prod(box.high - box.low)))
    assert shape is not None
    part = box.spec.of(box.problem.full_design())
    assert analyse_outline(box, part, shape, 2.0, "neo-hookean")["efficiency"] > 0.3


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
