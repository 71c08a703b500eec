"""Elementary actuators, struts and bundled machines as sources of the gallery."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from bellcrank.errors import BellcrankError, UnknownName
from bellcrank.machines.bundled import bundled_machine, find_plan, machines_in
from bellcrank.machines.bundled.contact import bundled_contact
from bellcrank.machines.elementary import strut_named
from bellcrank.machines.library import kind_title, library
from bellcrank.web.gallery import Entry, LazyEntries

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

STRUT = re.compile(r"strut-([3-9]|[1-3][0-9])")
LISTED = ("strut-3", "strut-4", "strut-6", "strut-9")


class Actuators:
    """Elementary actuators: the bundled library and the user's own entries.

    They are read once; entries that are added later appear after a restart.
    """

    name = "library"
    title = "Elementary actuators"

    def __init__(self) -> None:
        self._known = LazyEntries(_actuators)

    def entries(self) -> Iterable[Entry]:
        """Return all readable entries."""
        return self._known().values()

    def find(self, key: str) -> Entry | None:
        """Return the entry with a key, or None."""
        return self._known().get(key)


def _actuators() -> Iterator[Entry]:
    known = library()
    for summary in known.summaries:
        try:
            design = known.find(summary.name).design
        except BellcrankError:
            continue
        width = "" if summary.columns is None else f"{summary.columns} wide"
        load = kind_title(summary.kind)
        title = ", ".join(filter(None, (summary.direction.capitalize(), width)))
        facets = {"Moves": summary.direction, "Size": width, "Kind": load}
        yield Entry(summary.name, title, load, design, facets)


class Struts:
    """Bars that transmit a motion unchanged: fingers and spacers of machines."""

    name = "struts"
    title = "Struts"

    def entries(self) -> Iterable[Entry]:
        """Return struts of common lengths."""
        return [entry for name in LISTED if (entry := self.find(name)) is not None]

    def find(self, key: str) -> Entry | None:
        """Return the strut with a key such as ``strut-6``."""
        design = strut_named(key) if STRUT.fullmatch(key) else None
        if design is None:
            return None
        return Entry(key, f"Strut, {key.removeprefix('strut-')} long", "transmits a motion", design)


class Machines:
    """Bundled machines, built at the first access."""

    name = "machines"
    title = "Machines"

    def __init__(self) -> None:
        self._known = LazyEntries(_machines)

    def entries(self) -> Iterable[Entry]:
        """Return all machines."""
        return self._known().values()

    def find(self, key: str) -> Entry | None:
        """Return the entry with a key, or None."""
        return self._known().get(key)

    def plan(self, key: str) -> dict[str, Any]:
        """Return the plan of a machine, with gallery names of its parts.

        Raises
        ------
        UnknownName
            If there is no machine of that name.
        """
        if key not in self._known():
            raise UnknownName(f"there is no machine {key!r}")
        plan = find_plan(key).table.model_dump(by_alias=True, exclude_defaults=True)
        for part in plan["parts"].values():
            source = Struts.name if STRUT.fullmatch(part["entry"]) else Actuators.name
            part["entry"] = f"{source}/{part['entry']}"
        return plan


def _machines() -> Iterator[Entry]:
    for name in (*machines_in(2), *machines_in(3)):
        machine = bundled_machine(name)
        table = machine.plan.table
        note = f"{table.about}; {bundled_contact(name).message}"
        yield Entry(name, table.name.capitalize(), note, machine.design)
