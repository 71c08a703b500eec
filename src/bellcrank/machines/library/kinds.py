"""What elementary actuators are made for: a registry of kinds.

What serves an actuator depends on what it pushes against (`docs/machines.md`). A kind is the load
that a search works against and the goals that it keeps, so that a library holds actuators for all
places in a chain.
"""

from __future__ import annotations

from dataclasses import dataclass

from bellcrank.registry import Registry

OWN = "own"
"""Kind of an entry that is somebody's own design, made for who knows what."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of elementary actuator.

    Parameters
    ----------
    about
        What it is good for, in a sentence.
    spring
        k_ext at each output node that the search works against; None for a free output.
    goals
        What the search keeps beside.

    Examples
    --------
    >>> kinds["loaded"].spring, kinds["light"].goals[0]
    (0.02, 'input-stiffness <= 0.1')
    """

    about: str
    spring: float | None = None
    goals: tuple[str, ...] = ()


kinds: Registry[Kind] = Registry("kind of actuator")
kinds.register("free")(Kind("goes far, with nothing in its way"))
kinds.register("loaded")(Kind("pushes: made against springs at its output", spring=0.02))
kinds.register("light")(
    # The lower bound keeps a search from mechanisms, which follow the input and resist nothing.
    Kind(
        "easy to drive, so that others can: for the last stage of a chain",
        goals=("input-stiffness <= 0.1", "input-stiffness >= 0.001"),
    )
)
