"""A library of elementary actuators: found by searches, measured, and known by name.

Each `Entry` is a design with two ports, its two-port, what finite elements say of the part, and how
much better than the plain lever it is. `library` finds entries, `make` makes them.

Examples
--------
>>> from bellcrank.machines.library import library
>>> best = library().search(direction="down", columns=9, kind="free", better=True)[0]
>>> entry = library().find(best.name)
>>> entry.efficiency > entry.lever.efficiency
True
"""

from bellcrank.machines.library.catalogue import (
    SORTS,
    Library,
    find_entry,
    library,
    shipped_folder,
    user_folder,
)
from bellcrank.machines.library.entry import Entry, FrameCheck, LeverCheck
from bellcrank.machines.library.files import read_entry, write_entry
from bellcrank.machines.library.kinds import Kind, kinds
from bellcrank.machines.library.lever import plain_lever
from bellcrank.machines.library.making import Made, make
from bellcrank.machines.library.measuring import measure
from bellcrank.machines.library.orders import Order, Task
from bellcrank.machines.library.summary import Summary

__all__ = [
    "SORTS",
    "Entry",
    "FrameCheck",
    "Kind",
    "LeverCheck",
    "Library",
    "Made",
    "Order",
    "Summary",
    "Task",
    "find_entry",
    "kinds",
    "library",
    "make",
    "measure",
    "plain_lever",
    "read_entry",
    "shipped_folder",
    "user_folder",
    "write_entry",
]
