"""Library of elementary actuators, found by searches, refined and measured.

An `Entry` is a design with its two-port and the figures of the part. `library` finds entries. The
modules `library_measurement` and `library_making` of `bellcrank.workflows` measure a design as an
entry and search for new entries.

Examples
--------
>>> from bellcrank.machines.library import library
>>> best = library().search(direction="down", part={"payload_N": 0.5}, sort="gain")[0]
>>> entry = library().find(best.name)
>>> entry.figures["off_axis"] <= 0.05
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
    kind_title,
    kinds,
)
from bellcrank.machines.library.files import entry_to_dict, read_entry, write_entry

__all__ = [
    "SORTS",
    "Entry",
    "FrameResult",
    "Kind",
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
