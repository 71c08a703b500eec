"""Problems from tasks: units, places, loads, items."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidFile
from bellcrank.model import problem_from_dict, problem_to_dict
from bellcrank.task import build_task, bundled_tasks, find_task, read_task, task_from_dict
from bellcrank.task.domain import fill
from bellcrank.task.items import arc
from bellcrank.task.schema import (
    CaseSection,
    DomainSection,
    InputSection,
    NodeRegion,
    OutputSection,
    SupportSection,
    TaskTable,
)
from bellcrank.task.shapes import box
from tests.task.test_wrong_tasks import INPUT, OUTPUT, SLIDER, changed

if TYPE_CHECKING:
    from pathlib import Path


def test_lengths_forces_and_masses_are_converted_to_lattice_units() -> None:
    task = task_from_dict(
        changed(
            {
                "part.spacing": "8 mm",
                "domain.size": ["66 mm", "58 mm"],
                "cases.0.loads": [
                    {"at": {"edge": "top"}, "direction": "down", "force": "0.6 N"},
                    {"at": {"edge": "left"}, "direction": "left", "spring": "0.5 N/mm"},
                ],
                "cases.0.gravity": "down",
                f"{OUTPUT}.payload": "10 g",
            }
        )
    )
    problem, units = task.problem, task.units
    assert problem.input.amount * units.length == pytest.approx(3.0)
    (force,), (spring,) = problem.loads.forces, problem.loads.springs
    assert (force.force.sum(axis=0) * units.force).tolist() == pytest.approx([0.0, -0.6])
    total = spring.stiffness * len(spring.nodes) * units.force / units.length
    assert total == pytest.approx(0.5)
    payload = next(item for item in problem.specification.items if item.quantity == "payload")
    assert payload.at_least * units.force == pytest.approx(0.01 * 9.80665)
    # The weight of all struts: volume in mm^3, density of NinjaFlex in g / mm^3.
    volume = 2.0 * 5.0 * 8.0 * problem.lattice.rest_length.sum()
    weight = problem.section.area * problem.lattice.rest_length.sum() * -problem.loads.weight[1]
    assert weight * units.force == pytest.approx(volume * 1.19e-3 * 9.80665e-3)


def test_a_domain_is_filled_with_struts_that_lie_inside_and_is_symmetric() -> None:
    region = box(10.0, 0.0, 92.0, 70.0)
    lattice = fill(region, spacing=10.0, width=2.0)
    positions = 10.0 * lattice.positions
    assert (positions.min(axis=0) >= [11.0 - 1e-9, 1.0 - 1e-9]).all()
    assert (positions.max(axis=0) <= [91.0 + 1e-9, 69.0 + 1e-9]).all()
    assert lattice.rest_length == pytest.approx(np.ones(lattice.beam_count))
    mirrored = {(round(102.0 - x, 6), round(y, 6)) for x, y in positions.tolist()}
    assert mirrored == {(round(x, 6), round(y, 6)) for x, y in positions.tolist()}


def test_holes_stay_free_and_solid_regions_keep_their_beams() -> None:
    task = task_from_dict(
        changed(
            {
                "domain.size": [82, 72],
                "domain.holes": [{"circle": [41, 40], "radius": "9 mm"}],
                "domain.solid": [{"box": [0, 0, 82, 20]}],
                f"{INPUT}.at": {"edge": "right", "between": [40, 60]},
                f"{OUTPUT}.at": {"edge": "top", "between": [5, 20]},
            }
        )
    )
    lattice = task.problem.lattice
    ends = 10.0 * lattice.positions[lattice.beams]
    along = np.linspace(0.0, 1.0, 21)[:, None, None]
    points = ends[:, 0] * (1.0 - along) + ends[:, 1] * along
    assert np.linalg.norm(points - [41.0, 40.0], axis=2).min() >= 10.0 - 1e-6
    low = (ends[:, :, 1] <= 20.0).all(axis=1)
    assert not low[task.problem.designable].any()


def test_items_of_a_task_have_bounds_ranges_and_reductions() -> None:
    task = find_task("lever")
    gain = task.problem.specification.items[0]
    assert (gain.quantity, gain.start, gain.stop) == ("gain", 0.0, 1.0)
    assert (gain.at_least, gain.at_most) == pytest.approx((2.94, 3.06))
    switch = find_task("switch").problem.specification.items
    forces = [item.of for item in switch if item.quantity == "input_force"]
    assert forces == ["largest", "smallest", "every"]
    spread = find_task("constant-force").problem.specification.items[1]
    assert (spread.quantity, spread.of, spread.at_most) == ("input_force", "spread", 0.1)
    names = [item.quantity for item in switch]
    assert names[-2:] == ["strain", "clearance"]
    hub = next(
        item for item in find_task("twist").problem.specification.items
        if item.quantity == "rotation"
    )  # fmt: skip
    assert (hub.at_least, hub.start) == (10.0, 1.0)
    straight = next(
        item for item in find_task("slider").problem.specification.items
        if item.quantity == "rotation"
    )  # fmt: skip
    assert (straight.at_least, straight.at_most, straight.start) == (-3.0, 3.0, 0.0)


def test_cases_share_the_lattice_and_exclude_each_others_nodes_from_the_design() -> None:
    problem = find_task("selector").problem
    cases = problem.cases
    assert list(cases) == ["A", "B"]
    used = np.concatenate([case.special_nodes for case in cases.values()])
    assert not problem.lattice.beams_touching(np.unique(used))[problem.designable].any()
    assert cases["A"].input.direction[0].tolist() == [1.0, 0.0]
    assert cases["B"].output.direction[0].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("name", bundled_tasks())
def test_a_bundled_task_is_written_and_read_as_a_problem(name: str) -> None:
    problem = read_task(bundled_tasks()[name]).problem
    data = json.loads(json.dumps(problem_to_dict(problem)))
    again = problem_from_dict(data)
    assert again.hash == problem.hash
    assert problem_to_dict(again) == data


def test_a_task_in_python_equals_that_in_a_file(tmp_path: Path) -> None:
    table = TaskTable(
        name="slider",
        domain=DomainSection(size=(62.0, 54.0)),
        supports=[SupportSection(at=[NodeRegion(edge="bottom")])],
        cases=[
            CaseSection(
                inputs=[
                    InputSection(
                        at=[NodeRegion(point=(51.0, 53.0))], direction="down", displacement="3 mm"
                    )
                ],
                outputs=[
                    OutputSection(
                        at=[NodeRegion(point=(11.0, 53.0))], direction="left", gain="maximise"
                    )
                ],
            )
        ],
    )
    path = tmp_path / "slider.json"
    path.write_text(json.dumps(SLIDER), encoding="utf-8")
    assert build_task(table).problem.hash == read_task(path).problem.hash


def test_outlines_are_read_from_svg_and_dxf_files(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    pytest.importorskip("svgelements")
    (tmp_path / "part.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="90mm" height="80mm" viewBox="0 0 90 80">'
        '<rect x="0" y="0" width="90" height="80"/><circle cx="45" cy="30" r="9"/></svg>',
        encoding="utf-8",
    )
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (90, 0), (90, 80), (0, 80)], close=True)
    space.add_circle((45, 50), 9)
    document.saveas(tmp_path / "part.dxf")
    changes = {
        f"{INPUT}.at": {"edge": "right", "between": [40, 60]},
        f"{OUTPUT}.at": {"edge": "top", "between": [5, 30]},
    }
    lattices = []
    for outline in ("part.svg", "part.dxf"):
        data = changed({"domain": {"outline": outline}, **changes})
        lattices.append(task_from_dict(data, folder=tmp_path).problem.lattice)
    holes = {"domain": {"size": [90, 80], "holes": [{"circle": [45, 50], "radius": 9}]}}
    expected = task_from_dict(changed({**holes, **changes})).problem.lattice
    for lattice in lattices:
        assert lattice.positions == pytest.approx(expected.positions, abs=1e-3)
        assert np.array_equal(lattice.beams, expected.beams)


def test_an_outline_without_closed_curve_is_an_error(tmp_path: Path) -> None:
    pytest.importorskip("svgelements")
    (tmp_path / "part.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9">'
        '<line x1="0" y1="0" x2="9" y2="9"/></svg>',
        encoding="utf-8",
    )
    with pytest.raises(InvalidFile, match=r"no closed curve found"):
        task_from_dict(changed({"domain": {"outline": "part.svg"}}), folder=tmp_path)


def test_an_arc_turns_left_for_positive_angles_and_has_its_length() -> None:
    points = arc(20.0, -60.0, (0.0, 1.0))
    assert points[-1] == pytest.approx([10.0, 20.0 * math.sin(math.pi / 3)])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert length == pytest.approx(20.0 * math.pi / 3, rel=1e-3)
