"""What stands in a file of the schema ``bellcrank/two-port/1``, table by table."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from bellcrank.mechanics import UnloadedBeams  # noqa: TC001 - pydantic reads it
from bellcrank.model.parsing import Table

SCHEMA = "bellcrank/two-port/1"


class PortTable(Table):
    """A region."""

    nodes: list[int]
    centre: list[float]
    direction: list[float]


class RestTable(Table):
    """The linear two-port; null for an infinite compliance."""

    input_stiffness: float
    efficiency: float
    output_compliance: float | None


class CurveTable(Table):
    """A way along the stroke."""

    load: str
    motion: list[float]
    input_force: list[float]
    output: list[float]
    output_force: list[float]
    energy: list[float]
    status: Literal["converged", "snapped"]
    reached: float


class PotentialTable(Table):
    """A fitted potential and its error."""

    prescribed: list[bool]
    quadratic: list[list[float]]
    scale: list[float]
    exponents: list[list[int]]
    coefficients: list[float]
    degree: int
    samples: int
    held_out: int
    lost: int
    low: list[float]
    high: list[float]
    error: list[float]
    typical_error: list[float]


class CharacterisationTable(Table):
    """A whole file."""

    schema_: Literal["bellcrank/two-port/1"] = Field(alias="schema")
    name: str
    problem_hash: str
    mask: str
    beams: int
    unloaded_beams: UnloadedBeams
    drive: Literal["displacement", "force"]
    input: PortTable
    output: PortTable
    rest: RestTable
    blocks: list[list[float]] | None
    curves: list[CurveTable]
    potentials: dict[Literal["mean", "block"], PotentialTable]
    doubts: list[str]
    provenance: dict[str, Any]
