"""Elementary actuators and machines that come along, as sources of the gallery."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.errors import BellcrankError
from bellcrank.machines.library import library
from bellcrank.machines.showcases import showcase, showcases
from bellcrank.web.gallery import Entry

if TYPE_CHECKING:
    from collections.abc import Iterable


class Actuators:
    """Elementary actuators: those that come along, and the user's own.

    Read once, when somebody first looks: what is added meanwhile is seen after a new start.
    """

    name = "library"
    title = "Elementary actuators"

    def __init__(self) -> None:
        self._entries: dict[str, Entry] = {}

    def entries(self) -> Iterable[Entry]:
        """Return all entries that can be read, by name."""
        if not self._entries:
            known = library()
            for summary in known.summaries:
                try:
                    design = known.find(summary.name).design
                except BellcrankError:
                    continue
                width = "" if summary.columns is None else f", {summary.columns} wide"
                title = f"{summary.direction}{width}"
                self._entries[summary.name] = Entry(summary.name, title, summary.kind, design)
        return self._entries.values()

    def find(self, key: str) -> Entry | None:
        """Return the one of that name."""
        self.entries()
        return self._entries.get(key)


class Machines:
    """Machines that come with the package; built when somebody first looks."""

    name = "machines"
    title = "Machines"

    def __init__(self) -> None:
        self._entries: dict[str, Entry] = {}

    def entries(self) -> Iterable[Entry]:
        """Return all of them, by name."""
        if not self._entries:
            for name in showcases():
                machine = showcase(name)
                note = f"{len(machine.parts)} parts"
                self._entries[name] = Entry(name, machine.plan.table.name, note, machine.design)
        return self._entries.values()

    def find(self, key: str) -> Entry | None:
        """Return the one of that name."""
        self.entries()
        return self._entries.get(key)
