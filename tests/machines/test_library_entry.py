"""Entries of the library: what is written is read, and nothing that was changed."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.errors import InvalidFile, InvalidSettings, OutputExists, StorageError
from bellcrank.machines import characterisation_to_dict, elementary
from bellcrank.machines.library import Entry, read_entry, write_entry
from bellcrank.machines.library.catalogue import read_summary
from bellcrank.machines.library.entry import identity
from bellcrank.machines.library.files import checksum, entry_from_dict, entry_to_dict
from bellcrank.workflows.library_measurement import measure

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


@pytest.fixture(scope="module")
def entry(own_entry: Entry) -> Entry:
    """Return an entry of the user."""
    return own_entry


def test_what_is_written_is_read(entry: Entry, tmp_path: Path) -> None:
    path = write_entry(entry, tmp_path)
    found = read_entry(path)
    assert path.stem == found.name == entry.name
    assert found.design.mask_hex == entry.design.mask_hex
    assert found.design.problem.hash == entry.design.problem.hash
    assert characterisation_to_dict(found.characterisation) == characterisation_to_dict(
        entry.characterisation
    )
    for name in ("direction", "columns", "kind", "validation", "provenance", "figures"):
        assert getattr(found, name) == getattr(entry, name), name
    assert found.efficiency == entry.efficiency
    assert entry_to_dict(found) == entry_to_dict(entry)


def test_a_file_is_small_and_never_replaced_by_accident(entry: Entry, tmp_path: Path) -> None:
    path = write_entry(entry, tmp_path)
    assert path.stat().st_size < 40_000
    with pytest.raises(OutputExists):
        write_entry(entry, tmp_path)
    with pytest.raises(StorageError, match="cannot be written"):
        write_entry(entry, tmp_path / "nowhere")


def test_a_name_says_what_it_is_and_depends_on_problem_beams_and_kind(entry: Entry) -> None:
    stem, _, digits = entry.name.rpartition("-")
    assert (stem, len(digits)) == ("left-own", 8)
    design = entry.design
    other = design.mask.copy()
    other[design.problem.designable[0]] = False
    hashes = {
        identity(design, "own"),
        identity(design, "straight-10g"),
        identity(design.with_mask(other), "own"),
        identity(elementary(7, "up").full_design(), "own"),
    }
    assert len(hashes) == 4
    assert identity(replace(design, efficiency=7.0, provenance={"a": 1}), "own") == digits


def changed(*keys: str, to: Any) -> Callable[[dict[str, Any]], None]:
    def change(data: dict[str, Any]) -> None:
        place = data
        for key in keys[:-1]:
            place = place[key]
        place[keys[-1]] = to

    return change


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (changed("design", "efficiency", to=9.0), "checksum: does not match"),
        (changed("validation", "strain", to=0.0), "checksum: does not match"),
        (changed("provenance", "seed", to=2), "checksum: does not match"),
        (changed("extra", to=1), "unknown key 'extra'"),
        (changed("schema", to="bellcrank/entry/1"), "schema"),
        (changed("validation", "efficiency", to="good"), "validation.efficiency"),
    ],
)
def test_a_changed_file_is_refused_in_one_line(
    entry: Entry, tmp_path: Path, change: Callable[[dict[str, Any]], None], told: str
) -> None:
    path = write_entry(entry, tmp_path)
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    for read in (read_entry, read_summary):
        with pytest.raises(InvalidFile) as caught:
            read(path)
        assert str(path) in str(caught.value)
        assert told in str(caught.value)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (changed("design", "mask", to="00" * 17), "mask"),
        (changed("kind", to="straight-10g"), "name: expected"),
        (changed("direction", to="sideways"), "direction: expected one of"),
        (changed("kind", to="strong"), "unknown kind of actuator 'strong'"),
        (
            changed("characterisation", "mask", to="00"),
            "belongs to another design",
        ),
    ],
)
def test_a_name_is_compared_with_what_is_in_the_file(
    entry: Entry, change: Callable[[dict[str, Any]], None], told: str
) -> None:
    """Whoever renews the checksum has still not made another design of the same name."""
    data = json.loads(json.dumps(entry_to_dict(entry)))
    del data["checksum"]
    change(data)
    with pytest.raises(InvalidFile, match=told):
        entry_from_dict({**data, "checksum": checksum(data)}, "here")


def test_a_file_must_be_called_like_its_entry(entry: Entry, tmp_path: Path) -> None:
    path = write_entry(entry, tmp_path)
    moved = path.rename(tmp_path / "best.json")
    for read in (read_entry, read_summary):
        with pytest.raises(InvalidFile, match=f"{entry.name}.json"):
            read(moved)


def test_a_mechanism_is_no_entry() -> None:
    """A bar that hangs between the ports follows the input, and resists nothing."""
    problem = elementary(7, "down")
    heights = problem.lattice.positions[:, 1]
    at_ports = np.concatenate([problem.input.nodes, problem.output.nodes])
    row = heights > heights[at_ports].min() - 0.1
    bar = problem.full_design().with_mask(row[problem.lattice.beams].all(axis=1))
    with pytest.raises(InvalidSettings, match="nothing resists its input"):
        measure(bar)


def test_an_output_that_is_not_connected_is_no_entry() -> None:
    design = elementary(7, "down").full_design()
    mask = design.mask.copy()
    mask[design.problem.lattice.beams_touching(design.problem.output.nodes)] = False
    with pytest.raises(InvalidSettings, match="nothing resists its output"):
        measure(design.with_mask(mask))


def test_an_entry_tells_its_figures_in_a_line(entry: Entry, tmp_path: Path) -> None:
    told = read_summary(write_entry(entry, tmp_path))
    rest = entry.characterisation.rest
    assert told.efficiency == entry.efficiency
    assert np.array_equal(told.two_port.stiffness, rest.stiffness)
    assert told.name == entry.name
    assert told.warnings == bool(entry.warnings)
