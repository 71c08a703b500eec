"""Wrong task files: one clear error each, with key, value and what is allowed."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.task import task_from_dict

SLIDER: dict[str, Any] = {
    "schema": "bellcrank/task/1",
    "name": "slider",
    "part": {"width": "2 mm", "material": "ninjaflex"},
    "domain": {"size": ["62 mm", "54 mm"]},
    "supports": [{"at": {"edge": "bottom"}}],
    "cases": [
        {
            "inputs": [
                {"at": {"point": [51, 53]}, "direction": "down", "displacement": "3 mm"},
            ],
            "loads": [],
            "outputs": [
                {"at": {"point": [11, 53]}, "direction": "left", "gain": "maximise"},
            ],
        }
    ],
    "limits": {},
}
INPUT = "cases.0.inputs.0"
OUTPUT = "cases.0.outputs.0"
AT_OUTPUT = {"at": {"point": [11, 53]}, "direction": "down"}


def changed(changes: dict[str, Any]) -> dict[str, Any]:
    """Return the task with values at dotted keys replaced; None removes a key."""
    data = copy.deepcopy(SLIDER)
    for path, value in changes.items():
        *folders, last = (int(key) if key.isdigit() else key for key in path.split("."))
        place: Any = data
        for key in folders:
            place = place[key]
        if value is None:
            del place[last]
        else:
            place[last] = value
    return data


WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("a misspelt key", {"part.widht": 2}, "unknown key 'part.widht'; known here: width, thickness"),
    ("a missing name", {"name": None}, "key 'name' is missing"),
    ("a missing domain", {"domain": None}, "key 'domain' is missing"),
    ("no case", {"cases": []}, "cases: expected at least one"),
    ("another schema", {"schema": "bellcrank/task/2"}, "schema: expected 'bellcrank/task/1'"),
    ("words for a length", {"part.width": "thin"}, "part.width: expected a length like 2mm"),
    ("a force for a length", {"part.width": "2 N"}, "part.width: expected a length like 2mm"),
    ("metres without a unit", {"part.width": 0.002}, "part.width: expected a length from 0.1"),
    ("micrometres without a unit", {"part.thickness": 6000}, "thickness: expected a length from"),
    ("struts as wide as long", {"part.width": "10 mm"}, "part.width: struts 10 mm wide are not"),
    ("an unknown material", {"part.material": "steal"}, "part.material: unknown material 'ste"),
    ("a material without modulus", {"part.material": {"poisson": 0.3}}, "key 'young' is missing"),
    ("no domain at all", {"domain": {}}, "domain: expected one of size, outline, lattice and"),
    ("two domains", {"domain.problem": "crane"}, "domain: expected one of size, outline, lattice"),
    ("an unknown problem", {"domain": {"problem": "crain"}}, "unknown problem 'crain'; known: cr"),
    ("a domain for ants", {"domain.size": [6, 5]}, "no strut of the lattice, 10 mm long, fits"),
    ("a domain in metres", {"domain.size": [62000, 54000]}, "are the lengths in mm?"),
    ("a polygon of two", {"domain": {"outline": [[0, 0], [9, 9]]}}, "at least 3 corners, got 2"),
    ("a hole like the domain", {"domain.holes": [{"box": [-1, -1, 90, 90]}]}, "leave nothing"),
    ("a circle without radius", {"domain.holes": [{"circle": [9, 9]}]}, "circle and radius toget"),
    ("an outline that is missing", {"domain": {"outline": "part.dxf"}}, "part.dxf"),
    ("no support", {"supports": []}, "supports: expected at least one support"),
    ("an unknown edge", {"supports.0.at": {"edge": "floor"}}, "edge: expected 'left', 'right', '"),
    ("a far-away point", {f"{INPUT}.at": {"point": [70, 90]}}, "the node nearest to [70.0, 90.0]"),
    ("an empty box", {f"{OUTPUT}.at": {"box": [2, 2, 3, 3]}}, "no node lies in this box; the near"),
    ("a place of nothing", {f"{OUTPUT}.at": {}}, "expected one of point, edge, nodes, circle, box"),
    ("output on the input", {f"{OUTPUT}.at": {"point": [51, 53]}}, "is also in input.nodes"),
    ("no input", {"cases.0.inputs": []}, "cases[0].inputs: expected at least one"),
    ("no direction", {f"{INPUT}.direction": None}, "key 'cases[0].inputs[0].direction' is miss"),
    ("a wrong direction", {f"{INPUT}.direction": "south"}, "expected left, right, up, down, an a"),
    ("an input without size", {f"{INPUT}.displacement": None}, "expected displacement or force"),
    ("two drives on a bundled problem", {"domain": {"problem": "crane"}, "supports": [],
                                         INPUT: {"displacement": 3, "force": 1}},
     "cases[0].inputs[0]: expected displacement or force"),
    ("a stroke in micrometres", {f"{INPUT}.displacement": 3000}, "3000 mm is more than the size"),
    ("a stroke in metres", {f"{INPUT}.displacement": 0.003}, "less than a thousandth of the spac"),
    ("a negative stroke", {f"{INPUT}.displacement": -3}, "turn the direction for the opposite"),
    ("a range out of order", {f"{INPUT}.during": ["60%", "40%"]},
     "cases[0].inputs[0].during: expected an end that is at least 0.01 of the stroke after"),
    ("a range beyond the stroke", {f"{INPUT}.during": ["0%", "120%"]},
     "cases[0].inputs[0].during: expected fractions of the stroke from 0 to 1 (0% to 100%), got"),
    ("percentages without a sign", {f"{INPUT}.during": [0, 50]}, "(0% to 100%), got [0, 50]"),
    ("one end of a range", {f"{INPUT}.during": ["50%"]}, "during: expected two fractions of the"),
    ("words for a range", {f"{INPUT}.during": ["begin", "end"]}, "inputs[0].during[0]: expected"),
    ("a range that ends early", {f"{INPUT}.during": ["0%", "50%"]},
     "cases[0].inputs.during: no input moves and no force grows from 50% to 100%"),
    ("a short range of a load",
     {"cases.0.loads": [{**AT_OUTPUT, "force": "10 g", "during": [0, 0.005]}]},
     "cases[0].loads[0].during: expected an end that is at least 0.01 of the stroke after"),
    ("a spring in a part of the stroke",
     {"cases.0.loads": [{**AT_OUTPUT, "spring": 0.1, "during": ["0%", "50%"]}]},
     "cases[0].loads[0].during: expected a force, got a spring"),
    ("no output", {"cases.0.outputs": []}, "cases[0].outputs: expected at least one"),
    ("a gain as a number", {f"{OUTPUT}.gain": 3}, "gain: expected 'maximise', or a table like"),
    ("a target alone", {f"{OUTPUT}.gain": {"target": 3}}, "key 'tolerance' is missing"),
    ("crossed bounds", {f"{OUTPUT}.gain": {"at_least": 3, "at_most": 2}}, "at_least 3 exceeds at"),
    ("off-axis of 10", {f"{OUTPUT}.off_axis": 10}, "off_axis: expected at most 2, got 10; write"),
    ("a bare payload", {f"{OUTPUT}.payload": 50}, "a force like 0.5N or a mass like 50g, with it"),
    ("stroke of 50", {f"{OUTPUT}.gain": {"at_least": 1, "from": 50}}, "from: expected a part of "),
    ("range of a number", {f"{OUTPUT}.sag": {"at_most": 0.1, "from": 0}}, "is a single number"),
    ("a path elsewhere", {f"{OUTPUT}.path": {"points": [[9, 9], [8, 8]]}}, "begins at the rest po"),
    ("a path and an arc", {f"{OUTPUT}.path": {}}, "path: expected points or arc, and not both"),
    ("strain of 10", {"limits.strain": 10}, "limits.strain: 10 is 1000%; write '10%'"),
    ("a mass of 2 kg", {"limits.mass": "2 kg"}, "limits.mass: expected a mass above 0 and below"),
    ("a third of a turn", {"limits.symmetry": "3-fold"}, "limits.symmetry: expected x, y or xy in"),
    ("a mirror in depth", {"limits.symmetry": "z"}, "limits.symmetry: expected x, y or xy in the"),
    ("a short stroke", {"limits.stable_stroke": 0.5}, "stable_stroke: expected a part of the"),
    ("sag of unknown density", {"part.material": {"young": 9.0, "poisson": 0.4},
                                f"{OUTPUT}.sag": "10%"}, "the density of custom is unknown"),
    ("a load of nothing", {"cases.0.loads": [{"at": {"edge": "top"}, "direction": "down"}]},
     "cases[0].loads[0]: expected force or spring"),
    ("two unequal objectives", {f"{OUTPUT}.stiffness": "maximise"}, "expected a scale for each"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), [each[1:] for each in WRONG],
                         ids=[each[0] for each in WRONG])  # fmt: skip
def test_a_wrong_task_is_one_error_that_names_the_key(
    changes: dict[str, Any], message: str
) -> None:
    with pytest.raises((InvalidFile, InvalidProblem)) as caught:
        task_from_dict(changed(changes), "slider.toml")
    text = str(caught.value)
    assert text.startswith("slider.toml: ")
    assert message in text
    assert "\n" not in text


def test_at_least_forty_wrong_tasks_are_tried_and_the_right_one_is_accepted() -> None:
    assert len(WRONG) >= 40
    assert task_from_dict(SLIDER).problem.name == "slider"
