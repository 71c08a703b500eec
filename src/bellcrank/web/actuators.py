"""Elementary actuators, struts and machines that come along, as sources of the gallery."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from bellcrank.errors import BellcrankError, UnknownName
from bellcrank.machines.elementary import strut_named
from bellcrank.machines.library import library
from bellcrank.machines.showcases import find_plan, showcase, showcases
from bellcrank.web.gallery import Entry, Once

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

STRUT = re.compile(r"strut-([3-9]|[1-3][0-9])")
OFFERED = ("strut-3", "strut-4", "strut-6", "strut-9")
LOADS = {"free": "nothing in its way", "light": "easy to drive", "loaded": "pushes a load"}
"""What a kind of actuator is good for, as short as a small picture has room for."""


class Actuators:
    """Elementary actuators: those that come along, and the user's own.

    Read once, when somebody first looks: what is added meanwhile is seen after a new start.
    """

    name = "library"
    title = "Elementary actuators"

    def __init__(self) -> None:
        self._known = Once(_actuators)

    def entries(self) -> Iterable[Entry]:
        """Return all entries that can be read, by name."""
        return self._known().values()

    def find(self, key: str) -> Entry | None:
        """Return the one of that name."""
        return self._known().get(key)


def _actuators() -> Iterator[Entry]:
    known = library()
    for summary in known.summaries:
        try:
            design = known.find(summary.name).design
        except BellcrankError:
            continue
        width = "" if summary.columns is None else f"{summary.columns} wide"
        load = LOADS.get(summary.kind, summary.kind)
        title = ", ".join(filter(None, (summary.direction.capitalize(), width)))
        facets = {"Moves": summary.direction, "Size": width, "Made for": load}
        yield Entry(summary.name, title, load, design, facets)


class Struts:
    """Bars that pass a motion on as it is: fingers and spacers of machines."""

    name = "struts"
    title = "Struts"

    def entries(self) -> Iterable[Entry]:
        """Return some of usual lengths."""
        return [entry for name in OFFERED if (entry := self.find(name)) is not None]

    def find(self, key: str) -> Entry | None:
        """Return the strut of that name and length, such as ``strut-6``."""
        design = strut_named(key) if STRUT.fullmatch(key) else None
        if design is None:
            return None
        return Entry(key, f"Strut, {key.removeprefix('strut-')} long", "passes a motion on", design)


class Machines:
    """Machines that come with the package; built when somebody first looks."""

    name = "machines"
    title = "Machines"

    def __init__(self) -> None:
        self._known = Once(_machines)

    def entries(self) -> Iterable[Entry]:
        """Return all of them, by name."""
        return self._known().values()

    def find(self, key: str) -> Entry | None:
        """Return the one of that name."""
        return self._known().get(key)

    def plan(self, key: str) -> dict[str, Any]:
        """Return how a machine is made, its parts named as in the gallery.

        Raises
        ------
        UnknownName
            If there is no machine of that name.
        """
        if key not in showcases():
            raise UnknownName(f"there is no machine {key!r}")
        plan = find_plan(key).table.model_dump(by_alias=True, exclude_defaults=True)
        for part in plan["parts"].values():
            source = Struts.name if STRUT.fullmatch(part["entry"]) else Actuators.name
            part["entry"] = f"{source}/{part['entry']}"
        return plan


def _machines() -> Iterator[Entry]:
    for name in showcases():
        machine = showcase(name)
        table = machine.plan.table
        yield Entry(name, table.name.capitalize(), table.about, machine.design)
