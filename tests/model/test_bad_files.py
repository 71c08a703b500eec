"""Each thing that can be wrong in a file gives one sentence naming file and key."""

from __future__ import annotations

import pytest

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.model import problem_from_dict, read_design, read_masks, read_problem

MISSING = object()


def spoil(content, key, value):
    """Put `value` where `key` points, or take out what is there."""
    *way, last = [int(part) if part.isdigit() else part for part in key.split(".")]
    for part in way:
        content = content[part]
    if value is MISSING:
        del content[last]
    else:
        content[last] = value


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("schema", MISSING, "key 'schema' is missing"),
        ("schema", "bellcrank/problem/2", "schema: expected 'bellcrank/problem/1', got"),
        ("colour", "red", "unknown key 'colour'; known here: schema, name, lattice"),
        ("name", 3, "name: expected a valid string, got 3"),
        ("positions", MISSING, "key 'positions' is missing"),
        ("positions.2.1", float("nan"), "positions[2][1]: expected a finite number, got nan"),
        ("positions.2.1", float("inf"), "positions[2][1]: expected a finite number, got inf"),
        ("positions.2.1", "1.0", "positions[2][1]: expected a valid number, got '1.0'"),
        ("beams", MISSING, "key 'beams' is missing"),
        ("beams.7", [0, 1.5], "beams[7][1]: expected a valid integer"),
        ("lattice", {}, "expected positions and beams or a lattice, got both"),
        ("input", MISSING, "key 'input' is missing"),
        ("input.nodes", MISSING, "key 'input.nodes' is missing"),
        ("input.node", [1], "unknown key 'input.node'; known here: nodes, direction, drive"),
        ("input.nodes", ["5"], "input.nodes[0]: expected a node number or a region, got '5'"),
        ("input.nodes", [True], "input.nodes[0]: expected a node number or a region, got True"),
        ("input.during", "late", "input.during: expected a valid list, got 'late'"),
        ("input.drive", "pull", "input.drive: expected 'displacement' or 'force', got 'pull'"),
        ("input.amount", "0.1", "input.amount: expected a valid number, got '0.1'"),
        ("initial", "ffff", "initial: expected 2 hexadecimal digits for 8 beams, got 4"),
        ("initial", "zz", "initial: expected hexadecimal digits, got 'z' at position 0"),
        ("designable", [1.5], "designable[0]: expected a valid integer"),
        ("frozen", [0], "expected designable or frozen, got both"),
        ("stiffness", 5, "stiffness: expected a table, got 5"),
    ],
)
def test_files_that_break_the_schema_are_refused(write, small, key, value, message):
    spoil(small, key, value)
    assert_one_sentence(InvalidFile, message, read_problem, write(small))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("positions.2", [0.0], "positions[2]: expected 2 numbers as in positions[0], got [0.0]"),
        ("positions.1", [0, 0], "beams[0]: has no length, nodes 0 and 1"),
        ("beams.7", [0, 9], "beams[7][1]: expected a node from 0 to 5, got 9"),
        ("beams.7", [0, 1], "beams[7]: [0, 1] is the same beam as beams[0]"),
        ("beams.7", [3, 3], "beams[7]: joins node 3 to itself"),
        ("beams.7", [0, 1, 2], "beams[7]: expected 2 numbers as in beams[0], got [0, 1, 2]"),
        ("input.nodes", [], "input.nodes: expected at least one node, got none"),
        ("input.nodes", [6], "input.nodes[0]: expected a node from 0 to 5, got 6"),
        ("input.nodes", [4], "output.nodes: node 4 is also in input.nodes"),
        ("input.direction", [0, 3], "input.direction: expected unit vectors"),
        ("input.direction", ["0", "1"], "input.direction: expected numbers"),
        ("input.amount", 0, "input.amount: expected a number greater than 0, got 0"),
        ("input.during", [0.5, 0.2], "input.during: expected an end that is at least 0.005 of the"),
        ("input.during", [0, 0.5], "input.during: expected a problem with a section; in the"),
        ("input.during", [0, 2], "input.during: expected fractions of the stroke from 0 to 1"),
        ("output.spring", -1, "output.spring: expected a number greater than 0, got -1"),
        ("designable", [], "designable: no beam is left to design"),
        ("designable", [8], "designable[0]: expected a beam from 0 to 7, got 8"),
        ("stiffness.bond", 0, "stiffness.bond: expected a number greater than 0"),
        ("supports.fixed", [0, 0], "supports.fixed[1]: node 0 is listed twice"),
        ("supports.fixed", [5], "input.nodes: node 5 is also in supports.fixed"),
        ("objective", "", "objective: expected a name, got ''"),
    ],
)
def test_files_of_impossible_problems_are_refused(write, small, key, value, message):
    spoil(small, key, value)
    assert_one_sentence(InvalidProblem, message, read_problem, write(small))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[lattice]", "[lattice", "not valid TOML: Expected"),
        ("counts", "count", "unknown key 'lattice.count'; known here: counts, first_x, spacing"),
        ("first_x", "#", "key 'lattice.first_x' is missing"),
        ('kind = "triangular-rows"', "", "key 'lattice.kind' is missing"),
        ('"triangular-rows"', "3", "lattice.kind: expected a name, got 3"),
        ('"triangular-rows"', '"square"', "unknown lattice 'square'; known: "),
        ("[5, 6, 5, 6, 5, 6]", "[5, 6.5]", "lattice.counts[1]: expected a valid integer"),
        (
            "[5, 6, 5, 6, 5, 6]",
            '"many"',
            "lattice.counts: expected a valid list, got 'many'",
        ),
        ("first_x = [0.5,", "first_x = [nan,", "lattice.first_x[0]: expected a finite number"),
        ("amount = 0.433", "amount = inf", "input.amount: expected a finite number, got inf"),
        ("{ row = 0 }", "{ raw = 0 }", "supports.fixed[0]: expected one of the keys row, rows"),
        ("{ row = 0 }", "{ }", "supports.fixed[0]: expected one of the keys row, rows"),
        ("{ row = 0 }", "{ row = 0, left = 1 }", "unknown key 'supports.fixed[0].left'"),
        ("{ row = 0 }", "{ row = [0] }", "supports.fixed[0].row: expected a valid integer"),
        ("fixed = [{ row = 0 }]", "fixed = 0", "supports.fixed: expected a valid list, got 0"),
    ],
)
def test_toml_that_breaks_the_schema_is_refused(write, gripper, old, new, message):
    assert old in gripper
    path = write(gripper.replace(old, new), "bad.toml")
    assert_one_sentence(InvalidFile, message, read_problem, path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("first_x = [0.5,", "first_x = [0.7,", "lattice.first_x[1]: expected a row shifted by"),
        ("{ row = 0 }", "{ row = 6 }", "supports.fixed[0].row: expected -6 to 5"),
        ("-0.1, 4.0, 1.1, 5.0", "8, 8, 9, 9", "output.nodes[0]: no node lies in this region"),
        ("[lattice]", "frozen = [99]\n[lattice]", "frozen[0]: expected a node from 0 to 32"),
        ("[lattice]", "frozen = [{ rows = [1, 2, 3, 4, 5] }]\n[lattice]", "designable: no beam is"),
    ],
)
def test_toml_of_impossible_problems_is_refused(write, gripper, old, new, message):
    assert old in gripper
    path = write(gripper.replace(old, new), "bad.toml")
    assert_one_sentence(InvalidProblem, message, read_problem, path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"{", "not valid JSON: Expecting property name enclosed in double quotes (line 1,"),
        (b"", "not valid JSON: Expecting value (line 1, column 1)"),
        (b"[1, 2]", "expected a JSON object, got a list"),
        (b'{"name": "a", "name": "b"}', "not valid JSON: key 'name' is given twice"),
        (b"[" * 100_000, "not valid JSON: "),
        (b"\xff\xfe", "expected UTF-8 text, got byte 0xff at offset 0"),
    ],
)
def test_a_file_that_is_no_json_is_refused(tmp_path, text, message):
    path = tmp_path / "problem.json"
    path.write_bytes(text)
    assert_one_sentence(InvalidFile, message, read_problem, path)


def test_files_that_cannot_be_read_are_refused(tmp_path):
    (tmp_path / "folder.json").mkdir()
    for name, message in {
        "missing.json": "no such file",
        "folder.json": "cannot be read (Is a directory)",
        "problem.yaml": "expected a file ending in .toml or .json, got .yaml",
        "problem": "expected a file ending in .toml or .json, got no suffix",
    }.items():
        assert_one_sentence(InvalidFile, message, read_problem, tmp_path / name)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mask": "ffff"}, "mask: expected 2 hexadecimal digits for 8 beams, got 4"),
        ({"mask": None}, "mask: expected a valid string, got None"),
        ({"efficiency": float("nan")}, "efficiency: expected a finite number, got nan"),
        ({"schema": "bellcrank/design/9"}, "schema: expected 'bellcrank/design/1'"),
        ({"author": "me"}, "unknown key 'author'; known here: schema, problem, mask"),
        ({"problem": {"name": "x"}}, "problem: key 'schema' is missing"),
    ],
)
def test_bad_design_files_are_refused(write, small, change, message):
    data = {"schema": "bellcrank/design/1", "problem": small, "mask": "ff"}
    assert read_design(write(data)).efficiency is None
    assert_one_sentence(InvalidFile, message, read_design, write(data | change))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({}, "expected a list 'masks', or 'results' with a 'mask' in each"),
        ({"masks": "ff"}, "expected a list 'masks', or 'results' with a 'mask' in each"),
        ({"masks": ["ff"], "results": []}, "expected 'masks' or 'results', got both"),
        (
            {"masks": ["ff"], "stroke": 2},
            "unknown key 'stroke'; known here: masks, results, schema",
        ),
        ({"mask": "ff"}, "unknown key 'mask'"),
        ({"masks": ["ff", "f"]}, "masks[1]: expected 2 hexadecimal digits for 8 beams, got 1"),
        ({"masks": [255]}, "masks[0]: expected hexadecimal text, got 255"),
        ({"results": [{"mask": "ff"}, {}]}, "results[1].mask: expected hexadecimal text, got None"),
        ({"results": ["ff"]}, "results[0].mask: expected hexadecimal text, got None"),
    ],
)
def test_bad_masks_are_refused_naming_the_first(write, small, content, message):
    problem = problem_from_dict(small)
    assert_one_sentence(InvalidFile, message, read_masks, write(content), problem)


def assert_one_sentence(error, message, read, path, *more):
    with pytest.raises(error) as caught:
        read(path, *more)
    assert str(caught.value).startswith(f"{path}: {message}")
    assert "\n" not in str(caught.value)
