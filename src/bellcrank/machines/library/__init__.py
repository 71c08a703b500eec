"""Library of elementary actuators, found by searches and measured.

An `Entry` is a design with its two-port, the results of frame analyses of the part, and the plain
lever for the same problem. `library` finds entries. The module `measurement` measures a design as
an entry, and `making` searches for new entries; both are imported where they are used.

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
    Summary,
    bundled_folder,
    find_entry,
    library,
    user_folder,
)
from bellcrank.machines.library.entry import (
    Entry,
    FrameResult,
    Kind,
    LeverResult,
    kind_title,
    kinds,
)
from bellcrank.machines.library.files import entry_to_dict, read_entry, write_entry

__all__ = [
    "SORTS",
    "Entry",
    "FrameResult",
    "Kind",
    "LeverResult",
    "Library",
    "Summary",
    "bundled_folder",
    "entry_to_dict",
    "find_entry",
    "kind_title",
    "kinds",
    "library",
    "read_entry",
    "user_folder",
    "write_entry",
]
