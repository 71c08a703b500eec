"""Plans of machines: parts, their positions, links, input and output.

A plan is a TOML file::

    name = "two-stage amplifier"

    [parts.first]
    entry = "lever-9-down"

    [parts.second]
    entry = "lever-9-down"
    join = "first.output"

    [input]
    ports = ["first.input"]

    [output]
    ports = ["second.output"]

The ``entry`` of a part is a library entry or a design file. The part is reflected (``mirror``: x
changes its sign), in space turned over (``upside_down``: y and z change their signs), rotated and
scaled, in that order and about its input. Rotations are counter-clockwise, in the plane by a
multiple of 60 degrees, in space by a multiple of 30 about the vertical axis. Its input is then
placed at the point ``at``; or its input (or the port given by ``by``) is placed on the port given
by ``join``, and welded to it. Further links are tables ``[[links]]`` with ``from``, ``to`` and
``kind``: a ``weld`` merges coincident nodes of two ports; in the plane a ``bridge`` fills the space
between two ports with beams. The supports of a part with ``supports = false`` are a port too, by
which it stands on another part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from bellcrank.errors import InvalidFile
from bellcrank.model.parsing import Table, parse, read_toml

if TYPE_CHECKING:
    import os

PORTS = ("input", "output")
ROTATION_STEP = {2: 60, 3: 30}
"""Smallest rotations in the plane (a symmetry of the triangular lattice) and in space, degrees."""
BASE = "supports"
"""Port of the supports of a part, for links."""

Kind = Literal["weld", "bridge"]
Vector = Annotated[list[float], Field(min_length=2, max_length=3)]


def _directions(given: object) -> object:
    """Return one vector, or one for each port, as a list of vectors."""
    rows = given if isinstance(given, list) and given and isinstance(given[0], list) else [given]
    try:
        vectors = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        vectors = np.empty(0)
    if (
        vectors.shape not in {(len(rows), 2), (len(rows), 3)}
        or not np.isfinite(vectors).all()
        or not vectors.any(axis=1).all()
    ):
        raise PydanticCustomError(
            "vectors",
            "Input should be a nonzero vector [x, y] ([x, y, z] in space), or one for each port",
        )
    return vectors.tolist()


Directions = Annotated[list[list[float]], BeforeValidator(_directions)]
"""One vector for all ports, or one for each."""


class PartTable(Table):
    """A part: its design and its placement."""

    entry: str = Field(min_length=1)
    at: Vector | None = None
    join: str | None = None
    by: Literal["input", "output", "supports"] = "input"
    mirror: bool = False
    upside_down: bool = False
    rotate: int = 0
    scale: float = Field(default=1.0, gt=0.0)
    supports: bool = True


class LinkTable(Table):
    """A link of two ports."""

    from_: str = Field(alias="from")
    to: str
    kind: Kind = "weld"


class InputTable(Table):
    """Input of the machine; drive and amount default to those of the first part.

    The amount is required if the drive differs from that of the part.
    """

    ports: list[str] = Field(min_length=1)
    direction: Directions | None = None
    drive: Literal["displacement", "force"] | None = None
    amount: float | None = Field(default=None, gt=0.0)


class OutputTable(Table):
    """Output of the machine; directions default to those of the parts."""

    ports: list[str] = Field(min_length=1)
    direction: Directions | None = None


class MachineTable(Table):
    """A plan as it is written."""

    name: str = Field(min_length=1)
    about: str = ""
    parts: dict[str, PartTable] = Field(min_length=1)
    links: list[LinkTable] = Field(default_factory=list)
    input: InputTable
    output: OutputTable


@dataclass(frozen=True, slots=True, order=True)
class PortName:
    """A port of a part, written ``part.port``.

    Parameters
    ----------
    part
        Name of the part in the plan.
    port
        ``input`` or ``output``; in links also ``supports``.
    """

    part: str
    port: str

    def __str__(self) -> str:
        return f"{self.part}.{self.port}"


@dataclass(frozen=True, slots=True)
class Link:
    """A link of two ports.

    Parameters
    ----------
    first, second
        The ports.
    kind
        ``weld`` or ``bridge``.
    """

    first: PortName
    second: PortName
    kind: Kind


@dataclass(frozen=True, slots=True)
class Plan:
    """A checked plan: every port that it names exists.

    Parameters
    ----------
    source
        Name in error messages, usually the file.
    table
        The plan as it is written.
    links
        All links, those made by ``join`` included.
    order
        Names of the parts, each after the part that it joins.
    """

    source: str
    table: MachineTable
    links: tuple[Link, ...]
    order: tuple[str, ...]

    @property
    def inputs(self) -> list[PortName]:
        """Input ports of the machine."""
        return [port_name(text) for text in self.table.input.ports]

    @property
    def outputs(self) -> list[PortName]:
        """Output ports of the machine."""
        return [port_name(text) for text in self.table.output.ports]

    @property
    def ports(self) -> list[PortName]:
        """All ports: input and output of each part, and the supports that are linked."""
        linked = [port for link in self.links for port in (link.first, link.second)]
        bases = dict.fromkeys(port for port in linked if port.port == BASE)
        return [*(PortName(name, port) for name in self.table.parts for port in PORTS), *bases]


def read_plan(path: str | os.PathLike[str]) -> Plan:
    """Read a plan from a TOML file.

    Raises
    ------
    InvalidFile
        If the file cannot be read, has unknown keys or unknown ports, or a part is placed twice,
        not at all, or relative to itself.
    """
    source = str(path)
    return plan_of(parse(MachineTable, read_toml(path), source), source)


def plan_of(table: MachineTable, source: str) -> Plan:
    """Check the parts, ports and links of a plan.

    Raises
    ------
    InvalidFile
        As `read_plan`.
    """
    for name, part in table.parts.items():
        _check_part(name, part, source)
    links = []
    for name, part in table.parts.items():
        if part.join is not None:
            links.append(Link(port_name(part.join), PortName(name, part.by), "weld"))
    links += [Link(port_name(link.from_), port_name(link.to), link.kind) for link in table.links]
    plan = Plan(source, table, tuple(links), _in_order(table, source))
    named = [port for link in links for port in (link.first, link.second)]
    for port in (*named, *plan.inputs, *plan.outputs):
        is_base = port.port == BASE and port not in (*plan.inputs, *plan.outputs)
        if port.part not in table.parts or not (port.port in PORTS or is_base):
            raise InvalidFile(
                f"{source}: unknown port {str(port)!r}; expected PART.input or PART.output, in "
                f"links also PART.supports, with PART one of {', '.join(table.parts)}"
            )
        if is_base and table.parts[port.part].supports:
            raise InvalidFile(
                f"{source}: parts.{port.part}: its supports are linked; expected supports = false"
            )
    for name, region in (("input", table.input), ("output", table.output)):
        if region.direction and len(region.direction) not in (1, len(region.ports)):
            raise InvalidFile(
                f"{source}: {name}.direction: expected one vector, or one for each of "
                f"{len(region.ports)} ports, got {len(region.direction)}"
            )
    if both := [port for port in plan.inputs if port in plan.outputs]:
        raise InvalidFile(f"{source}: port {str(both[0])!r} is both input and output")
    for link in links:
        if link.first == link.second:
            raise InvalidFile(f"{source}: port {str(link.first)!r} is linked to itself")
    return plan


def port_name(text: str) -> PortName:
    """Split ``part.port``; without a dot, the name of the part is empty.

    Examples
    --------
    >>> port_name("first.output")
    PortName(part='first', port='output')
    """
    part, _, port = text.rpartition(".")
    return PortName(part, port)


def welded_ports(plan: Plan) -> tuple[tuple[PortName, ...], ...]:
    """Return all ports in groups that are welded together, directly or through other ports.

    Examples
    --------
    >>> table = MachineTable.model_validate({
    ...     "name": "fork", "input": {"ports": ["a.input"]}, "output": {"ports": ["b.output"]},
    ...     "parts": {"a": {"entry": "x"}, "b": {"entry": "x", "join": "a.output"},
    ...               "c": {"entry": "x", "join": "a.output"}},
    ... })
    >>> [" ".join(map(str, ports)) for ports in welded_ports(plan_of(table, "fork.toml"))]
    ['a.input', 'a.output b.input c.input', 'b.output', 'c.output']
    """
    together: dict[PortName, tuple[PortName, ...]] = {port: (port,) for port in plan.ports}
    for link in plan.links:
        first, second = together[link.first], together[link.second]
        if link.kind == "weld" and first != second:
            together.update(dict.fromkeys(first + second, first + second))
    return tuple(dict.fromkeys(together.values()))


def _check_part(name: str, part: PartTable, source: str) -> None:
    if "." in name:
        raise InvalidFile(f"{source}: parts.{name}: the name of a part must not contain a dot")
    if part.rotate % ROTATION_STEP[3]:
        raise InvalidFile(
            f"{source}: parts.{name}.rotate: expected a multiple of {ROTATION_STEP[2]} degrees in "
            f"the plane, and of {ROTATION_STEP[3]} in space, got {part.rotate}"
        )
    if part.at is not None and part.join is not None:
        raise InvalidFile(f"{source}: parts.{name}: placed twice, by 'at' and by 'join'")
    if part.join is not None and port_name(part.join).part == name:
        raise InvalidFile(f"{source}: parts.{name}.join: a part cannot join itself")


def _in_order(table: MachineTable, source: str) -> tuple[str, ...]:
    """Return the names of the parts, each after the part that it joins."""
    order: list[str] = []
    first = next(iter(table.parts))
    for wanted in table.parts:
        waiting: list[str] = []
        name = wanted
        while name not in order:
            part = table.parts[name]
            if name in waiting:
                cycle = ", ".join(waiting[waiting.index(name) :])
                raise InvalidFile(
                    f"{source}: the positions of parts {cycle} depend on each other; give one of "
                    f"them 'at' and link them in [[links]]"
                )
            waiting.append(name)
            if part.join is None:
                if part.at is None and name != first:
                    raise InvalidFile(
                        f"{source}: parts.{name}: no position; give it 'at' or 'join'"
                    )
                break
            name = port_name(part.join).part
            if name not in table.parts:
                raise InvalidFile(
                    f"{source}: parts.{waiting[-1]}.join: unknown part {name!r}; expected one of "
                    f"{', '.join(table.parts)}"
                )
        order += [each for each in reversed(waiting) if each not in order]
    return tuple(order)
