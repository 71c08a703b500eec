"""Bundled machines: plans made of library entries, struts and bundled parts, by name.

The parts are designs that `bellcrank design` has found for bundled tasks in space.

Examples
--------
>>> bundled_machines()
['amplifier', 'gripper', 'reverser', 'sorter-left', 'sorter-right', 'three-jaws', 'twister', 'wave']
>>> find_plan("gripper").table.input.ports
['left.input']
"""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path

from bellcrank.errors import UnknownName
from bellcrank.machines.assembly import Machine, assemble
from bellcrank.machines.elementary import strut_named
from bellcrank.machines.library import find_entry
from bellcrank.machines.plan import Plan, read_plan
from bellcrank.model import Design, read_design

SUFFIX = ".toml"
PREFIX = "machine:"


def bundled_machines() -> list[str]:
    """Return the names of the bundled machines, sorted."""
    names = (Path(each.name) for each in files(__package__).iterdir())
    return sorted(name.stem for name in names if name.suffix == SUFFIX)


def machines_in(dimension: int) -> list[str]:
    """Return the names of the bundled machines in the plane (2) or in space (3), sorted.

    Examples
    --------
    >>> machines_in(3)
    ['three-jaws', 'twister']
    """
    return [name for name in bundled_machines() if _dimension(find_plan(name)) == dimension]


def _dimension(plan: Plan) -> int:
    """Return the dimension of a machine, that of its first part."""
    first = next(iter(plan.table.parts.values()))
    return _design_named(first.entry).problem.lattice.dimension


def find_plan(name_or_path: str) -> Plan:
    """Return a plan from a file, or that of a bundled machine.

    Raises
    ------
    UnknownName
        If the name is neither a file nor a bundled machine.
    InvalidFile
        As `bellcrank.machines.read_plan`.
    """
    if Path(name_or_path).is_file() or Path(name_or_path).suffix == SUFFIX:
        return read_plan(name_or_path)
    if name_or_path not in bundled_machines():
        raise UnknownName(
            f"unknown plan {name_or_path!r}: expected a TOML file or one of "
            f"{', '.join(bundled_machines())}"
        )
    with as_file(files(__package__) / f"{name_or_path}{SUFFIX}") as path:
        return read_plan(path)


def bundled_machine(name: str) -> Machine:
    """Assemble a bundled machine.

    Raises
    ------
    UnknownName

    Examples
    --------
    >>> len(bundled_machine("wave").parts)
    10
    """
    return assemble(find_plan(name), _design_named)


def bundled_part(name: str) -> Design | None:
    """Return the bundled part of a name, with or without ``machine:`` before it; None if none.

    Examples
    --------
    >>> bundled_part("machine:twist-column").problem.lattice.dimension
    3
    """
    file = files(__package__) / "parts" / f"{name.removeprefix(PREFIX)}.json"
    if not file.is_file():
        return None
    with as_file(file) as path:
        return read_design(path)


def _design_named(entry: str) -> Design:
    return strut_named(entry) or bundled_part(entry) or find_entry(entry).design
