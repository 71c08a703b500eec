"""Machines that come with the package: plans of actuators of the library, by name.

Examples
--------
>>> sorted(showcases())
['amplifier', 'gripper', 'reverser', 'sorter-left', 'sorter-right', 'wave']
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

SUFFIX = ".toml"


def showcases() -> list[str]:
    """Return the names of the machines that come with the package."""
    here = files("bellcrank.machines.showcases")
    names = (Path(each.name) for each in here.iterdir())
    return sorted(name.stem for name in names if name.suffix == SUFFIX)


def find_plan(name_or_path: str) -> Plan:
    """Return a plan from a file, or one that comes with the package.

    Raises
    ------
    UnknownName
        If it is neither.
    InvalidFile
        As `bellcrank.machines.read_plan`.
    """
    if Path(name_or_path).is_file() or Path(name_or_path).suffix == SUFFIX:
        return read_plan(name_or_path)
    if name_or_path not in showcases():
        raise UnknownName(
            f"no plan {name_or_path!r}: neither a file nor one of {', '.join(showcases())}"
        )
    source = files("bellcrank.machines.showcases") / f"{name_or_path}{SUFFIX}"
    with as_file(source) as path:
        return read_plan(path)


def showcase(name: str) -> Machine:
    """Build a machine that comes with the package.

    Raises
    ------
    UnknownName

    Examples
    --------
    >>> len(showcase("wave").parts)
    10
    """
    return assemble(find_plan(name), lambda entry: strut_named(entry) or find_entry(entry).design)
