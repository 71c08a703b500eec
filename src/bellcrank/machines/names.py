"""Names of designs that this package provides: struts, library entries, bundled machines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.machines.bundled import PREFIX, bundled_machine, bundled_machines, bundled_part
from bellcrank.machines.elementary import strut_named
from bellcrank.machines.library import library

if TYPE_CHECKING:
    from bellcrank.model import Design


def design_from_name(name: str) -> Design | None:
    """Return the design with a name; None if no design of this package can have that name.

    Parameters
    ----------
    name
        ``strut-LENGTH``; a library entry by its name, the beginning of its name, or its hash; or
        a bundled machine or part, with or without ``machine:`` before its name.

    Raises
    ------
    UnknownName
        If the name has the form of a library entry, but there is none or more than one.
    InvalidFile, InvalidProblem
        If the file of the entry is damaged.

    Examples
    --------
    >>> design_from_name("strut-6").problem.name, design_from_name("crane")
    ('strut-6', None)
    """
    machine = name.removeprefix(PREFIX)
    if machine in bundled_machines():
        return bundled_machine(machine).design
    return strut_named(name) or bundled_part(name) or library().design(name)
