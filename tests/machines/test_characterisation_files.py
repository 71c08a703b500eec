"""Records: written and read back the same; every bad one refused in one sentence."""

from __future__ import annotations

import json
import math
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import pytest

from bellcrank.errors import InvalidFile, OutputExists
from bellcrank.machines import (
    Characterisation,
    Load,
    characterisation_from_dict,
    characterisation_to_dict,
    characterise,
    read_characterisation,
    write_characterisation,
)
from bellcrank.model import Design

from .test_two_port import actuator

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


@pytest.fixture(scope="module")
def found() -> Characterisation:
    return characterise(actuator("human:anti-parallel"), points=3)


@pytest.fixture(scope="module")
def plain(found: Characterisation) -> dict[str, Any]:
    return json.loads(json.dumps(characterisation_to_dict(found)))


def test_what_is_written_is_read_back_the_same(found: Characterisation, tmp_path: Path) -> None:
    path = tmp_path / "port.json"
    write_characterisation(found, path)
    back = read_characterisation(path)
    assert characterisation_to_dict(back) == characterisation_to_dict(found)
    assert back.rest == found.rest
    with pytest.raises(OutputExists):
        write_characterisation(found, path)
    write_characterisation(found, path, overwrite=True)


def test_a_loose_output_and_a_snapping_curve_are_kept_as_they_are(tmp_path: Path) -> None:
    design = actuator("machine:anti-parallel")
    snapped = characterise(design, [Load("blocked")], 4)
    touching = design.problem.lattice.beams_touching(design.problem.output.nodes)
    loose = characterise(Design(design.problem, design.mask & ~touching), points=1)
    for number, one in enumerate((snapped, loose)):
        path = tmp_path / f"{number}.json"
        write_characterisation(one, path)
        assert characterisation_to_dict(read_characterisation(path)) == (
            characterisation_to_dict(one)
        )
    assert math.isinf(read_characterisation(tmp_path / "1.json").rest.output_compliance)
    assert "Infinity" not in (tmp_path / "1.json").read_text()


def setting(*keys: Any, to: Any) -> Callable[[dict[str, Any]], None]:
    """What changes one entry of a record."""

    def change(data: Any) -> None:
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = to

    return change


BAD = [
    (setting("schema", to="bellcrank/two-port/9"), "schema: expected 'bellcrank/two-port/1'"),
    (setting("colour", to="red"), "unknown key 'colour'"),
    (setting("rest", "efficiency", to="much"), "rest.efficiency: expected a valid number"),
    (setting("rest", "output_compliance", to=0.0), "rest.output_compliance: .*greater than 0"),
    (
        setting("rest", "input_stiffness", to=-1.0),
        "rest.input_stiffness: expected greater than or equal",
    ),
    (setting("input", "centre", to=[1.0]), r"input.centre: .*at least 2 items"),
    (setting("curves", 0, "load", to="heavy"), r"curves\[0\].load 'heavy': expected free"),
    (
        setting("curves", 1, "energy", to=[0.0]),
        r"curves\[1\].energy: expected as many points as motion, 4, got 1",
    ),
    (setting("curves", 1, "status", to="fine"), r"curves\[1\].status: expected 'converged'"),
    (setting("drive", to="hand"), "drive: expected 'displacement' or 'force'"),
]


@pytest.mark.parametrize(("change", "message"), BAD, ids=[message for _, message in BAD])
def test_a_bad_record_is_refused_in_one_sentence(
    plain: dict[str, Any], change: Callable[[dict[str, Any]], None], message: str
) -> None:
    data = deepcopy(plain)
    change(data)
    with pytest.raises(InvalidFile, match=rf"^port: {message}") as refused:
        characterisation_from_dict(data, "port")
    assert "\n" not in str(refused.value)


def test_a_missing_key_is_named(plain: dict[str, Any]) -> None:
    data = deepcopy(plain)
    del data["curves"]
    with pytest.raises(InvalidFile, match="key 'curves' is missing"):
        characterisation_from_dict(data, "port")
