"""Actuators found by short searches, and machines of them.

Searched by `bellcrank.workflows.design` on `elementary(7, "down", 0.02)`, 3000 steps of the default
search, seed 1, and on `elementary(7, "down")` with the goal ``input-stiffness <= 0.1``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.errors import UnknownName
from bellcrank.machines import Machine, assemble, elementary
from bellcrank.machines.plan import MachineTable, plan_of
from bellcrank.model.masks import unpack_mask

if TYPE_CHECKING:
    from bellcrank.model import Design

MASKS = {
    "strong": "ffffe4929ffddfffcbfffaffffeffffffabfff9c",
    "soft": "afffc4945feea59e019245ff64d7fffecabfff8c",
}
"""One that can drive others, and one that is easily driven."""


def actuator(name: str) -> Design:
    if name not in MASKS:
        raise UnknownName(f"no design {name!r}")
    task = elementary(7, "down")
    return task.full_design().with_mask(unpack_mask(MASKS[name], task.lattice.beam_count))


def build(parts: dict[str, Any], outputs: list[str], **more: Any) -> Machine:
    drive = {"ports": more.pop("inputs", ["a.input"]), **more.pop("drive", {})}
    told = {"name": "chain", "parts": parts, "input": drive, "output": {"ports": outputs}, **more}
    return assemble(plan_of(MachineTable.model_validate(told), "chain.toml"), actuator)


STRONG, SOFT = {"entry": "strong"}, {"entry": "soft"}


def turned_by(parts: dict[str, Any], degrees: int, *, mirror: bool) -> dict[str, Any]:
    """All parts mirrored, if so, and turned together."""
    found = {}
    for name, part in parts.items():
        own = -part.get("rotate", 0) if mirror else part.get("rotate", 0)
        found[name] = {
            **part, "rotate": own + degrees, "mirror": part.get("mirror", False) != mirror,
        }  # fmt: skip
    return found


KINDS: dict[str, tuple[dict[str, Any], list[str], dict[str, Any]]] = {
    "row": ({"a": STRONG, "b": {**SOFT, "join": "a.output"}}, ["b.output"], {}),
    "turned": (
        {"a": STRONG, "b": {**SOFT, "join": "a.output", "rotate": 300}}, ["b.output"], {},
    ),
    "gripper": (
        {"a": SOFT, "b": {**SOFT, "join": "a.input", "mirror": True}},
        ["a.output", "b.output"], {},
    ),
    "driven by its output": (
        {"a": STRONG, "b": {**SOFT, "join": "a.output", "by": "output", "mirror": True}},
        ["b.input"], {},
    ),
    "bridge": (
        {"a": STRONG, "b": {**SOFT, "at": [-13.0, 0.0]}}, ["b.output"],
        {"links": [{"from": "a.output", "to": "b.input", "kind": "bridge"}]},
    ),
}  # fmt: skip
"""Machines by name: parts, outputs, and what else there is."""


def machine(kind: str, degrees: int = 0, *, mirror: bool = False, **more: Any) -> Machine:
    parts, outputs, rest = KINDS[kind]
    return build(turned_by(parts, degrees, mirror=mirror), outputs, **rest, **more)
