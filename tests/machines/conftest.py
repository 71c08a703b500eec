"""Fixtures of the tests of actuators and machines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bellcrank.machines import elementary
from bellcrank.workflows.library_measurement import measure

if TYPE_CHECKING:
    from bellcrank.machines.library import Entry


@pytest.fixture(scope="session")
def own_entry() -> Entry:
    """Entry of a full lattice of seven columns, measured as a design of the user."""
    return measure(elementary(7, "left").full_design(), points=3, notes={"seed": 1})
