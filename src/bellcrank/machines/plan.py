"""A machine as its maker writes it: parts, where they are, what links them, what drives them.

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

A part is an entry of the library or a design file. It is mirrored left to right, turned by
multiples of 60 degrees and scaled, in that order and about its input, and put where it belongs:
with its input on ``at``, or with its input (or the port that ``by`` names) on the port that
``join`` names, to which it is then welded. Further links are tables ``[[links]]`` with ``from``,
``to`` and ``kind``: a ``weld`` makes the nodes of two ports that lie on one another the same
nodes; a ``bridge`` fills what lies between two ports with beams.
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
TURN = 60
"""Degrees by which a triangular lattice may be turned."""

Kind = Literal["weld", "bridge"]
Vector = Annotated[list[float], Field(min_length=2, max_length=2)]


def _directions(given: object) -> object:
    """Take one vector for a list of one."""
    rows = given if isinstance(given, list) and given and isinstance(given[0], list) else [given]
    try:
        vectors = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        vectors = np.empty(0)
    if (
        vectors.shape != (len(rows), 2)
        or not np.isfinite(vectors).all()
        or not vectors.any(axis=1).all()
    ):
        raise PydanticCustomError(
            "vectors", "Input should be a vector [x, y] of some length, or one for each port"
        )
    return vectors.tolist()


Directions = Annotated[list[list[float]], BeforeValidator(_directions)]
"""One for all ports, or one for each."""


class PartTable(Table):
    """Where a part comes from and where it goes."""

    entry: str = Field(min_length=1)
    at: Vector | None = None
    join: str | None = None
    by: Literal["input", "output"] = "input"
    mirror: bool = False
    rotate: int = 0
    scale: float = Field(default=1.0, gt=0.0)
    supports: bool = True


class LinkTable(Table):
    """Two ports that are to move together."""

    from_: str = Field(alias="from")
    to: str
    kind: Kind = "weld"


class InputTable(Table):
    """What drives the machine; drive and amount are those of the first part by default.

    Who drives it in another way says by how much.
    """

    ports: list[str] = Field(min_length=1)
    direction: Directions | None = None
    drive: Literal["displacement", "force"] | None = None
    amount: float | None = Field(default=None, gt=0.0)


class OutputTable(Table):
    """What the machine moves; directions are those of the parts by default."""

    ports: list[str] = Field(min_length=1)
    direction: Directions | None = None


class MachineTable(Table):
    """A whole plan."""

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
        As the plan calls it.
    port
        ``input`` or ``output``.
    """

    part: str
    port: str

    def __str__(self) -> str:
        return f"{self.part}.{self.port}"


@dataclass(frozen=True, slots=True)
class Link:
    """Two ports that are to move together.

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
    """A plan in which every port that is named exists.

    Parameters
    ----------
    source
        What to call it in an error, usually the file.
    table
        As it was written.
    links
        Those of parts that join others included.
    order
        Names of the parts, each after the one that it joins.
    """

    source: str
    table: MachineTable
    links: tuple[Link, ...]
    order: tuple[str, ...]

    @property
    def inputs(self) -> list[PortName]:
        """Ports that drive the machine."""
        return [port_name(text) for text in self.table.input.ports]

    @property
    def outputs(self) -> list[PortName]:
        """Ports that the machine moves."""
        return [port_name(text) for text in self.table.output.ports]


def read_plan(path: str | os.PathLike[str]) -> Plan:
    """Read a plan, a TOML file.

    Raises
    ------
    InvalidFile
        If it cannot be read, has unknown keys, names ports that no part has, or places a part
        twice, nowhere, or on one that is placed on it.
    """
    source = str(path)
    return plan_of(parse(MachineTable, read_toml(path), source), source)


def plan_of(table: MachineTable, source: str) -> Plan:
    """Check what a plan says of its parts, ports and links.

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
        if port.part not in table.parts or port.port not in PORTS:
            raise InvalidFile(
                f"{source}: no port {str(port)!r}; a port is an input or output of one of "
                f"{', '.join(table.parts)}"
            )
    for name, region in (("input", table.input), ("output", table.output)):
        if region.direction and len(region.direction) not in (1, len(region.ports)):
            raise InvalidFile(
                f"{source}: {name}.direction: expected one vector, or one for each of "
                f"{len(region.ports)} ports, got {len(region.direction)}"
            )
    if both := [port for port in plan.inputs if port in plan.outputs]:
        raise InvalidFile(f"{source}: port {str(both[0])!r} is input and output at once")
    for link in links:
        if link.first == link.second:
            raise InvalidFile(f"{source}: port {str(link.first)!r} is linked to itself")
    return plan


def port_name(text: str) -> PortName:
    """Split ``part.port``; what has no dot is a port of no part.

    Examples
    --------
    >>> port_name("first.output")
    PortName(part='first', port='output')
    """
    part, _, port = text.rpartition(".")
    return PortName(part, port)


def welded(plan: Plan) -> tuple[tuple[PortName, ...], ...]:
    """Return all ports, those together that welds join, directly or by way of others.

    Examples
    --------
    >>> table = MachineTable.model_validate({
    ...     "name": "fork", "input": {"ports": ["a.input"]}, "output": {"ports": ["b.output"]},
    ...     "parts": {"a": {"entry": "x"}, "b": {"entry": "x", "join": "a.output"},
    ...               "c": {"entry": "x", "join": "a.output"}},
    ... })
    >>> [" ".join(map(str, ports)) for ports in welded(plan_of(table, "fork.toml"))]
    ['a.input', 'a.output b.input c.input', 'b.output', 'c.output']
    """
    every = [PortName(name, port) for name in plan.table.parts for port in PORTS]
    together: dict[PortName, tuple[PortName, ...]] = {port: (port,) for port in every}
    for link in plan.links:
        first, second = together[link.first], together[link.second]
        if link.kind == "weld" and first != second:
            together.update(dict.fromkeys(first + second, first + second))
    return tuple(dict.fromkeys(together.values()))


def _check_part(name: str, part: PartTable, source: str) -> None:
    if "." in name:
        raise InvalidFile(f"{source}: parts.{name}: a part's name cannot have a dot in it")
    if part.rotate % TURN:
        raise InvalidFile(
            f"{source}: parts.{name}.rotate: expected a multiple of {TURN} degrees, which a "
            f"triangular lattice can be turned by, got {part.rotate}"
        )
    if part.at is not None and part.join is not None:
        raise InvalidFile(f"{source}: parts.{name}: placed twice, by 'at' and by 'join'")
    if part.join is not None and port_name(part.join).part == name:
        raise InvalidFile(f"{source}: parts.{name}.join: a part cannot join itself")


def _in_order(table: MachineTable, source: str) -> tuple[str, ...]:
    """Return the parts' names, each after the one that it joins."""
    order: list[str] = []
    first = next(iter(table.parts))
    for wanted in table.parts:
        waiting: list[str] = []
        name = wanted
        while name not in order:
            part = table.parts[name]
            if name in waiting:
                circle = ", ".join(waiting[waiting.index(name) :])
                raise InvalidFile(
                    f"{source}: parts {circle} are placed on one another in a circle; give one of "
                    f"them 'at' and link them in [[links]]"
                )
            waiting.append(name)
            if part.join is None:
                if part.at is None and name != first:
                    raise InvalidFile(
                        f"{source}: parts.{name}: placed nowhere; give it 'at' or 'join'"
                    )
                break
            name = port_name(part.join).part
            if name not in table.parts:
                raise InvalidFile(
                    f"{source}: parts.{waiting[-1]}.join: no part {name!r}; there are "
                    f"{', '.join(table.parts)}"
                )
        order += [each for each in reversed(waiting) if each not in order]
    return tuple(order)
