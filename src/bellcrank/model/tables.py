"""Tables of a problem file, validated by pydantic; `bellcrank.model.schema` describes them."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from bellcrank.model.parsing import Table
from bellcrank.model.section import Shape


class StiffnessTable(Table):
    """``[stiffness]``."""

    bond: float = 5.0
    angle: float = 0.1


class SupportsTable(Table):
    """``[supports]``."""

    fixed: list[Any] = Field(default_factory=list)
    fixed_x: list[Any] = Field(default_factory=list)
    fixed_y: list[Any] = Field(default_factory=list)
    fixed_z: list[Any] = Field(default_factory=list)


class InputTable(Table):
    """``[input]``."""

    nodes: list[Any]
    direction: list[Any]
    drive: Literal["displacement", "force"]
    amount: float
    during: list[Any] | None = None


class OutputTable(Table):
    """``[output]``."""

    nodes: list[Any]
    direction: list[Any]
    spring: float | None = None
    spring_kind: Literal["directional", "isotropic"] | None = None


class ForceTable(Table):
    """An entry of ``loads.forces``."""

    nodes: list[Any]
    force: list[Any]
    during: list[Any] | None = None


class SpringTable(Table):
    """An entry of ``loads.springs``."""

    nodes: list[Any]
    direction: list[Any]
    stiffness: float


class LoadsTable(Table):
    """``[loads]``."""

    forces: list[ForceTable] = Field(default_factory=list)
    springs: list[SpringTable] = Field(default_factory=list)
    weight: list[float] | None = None
    weight_during: list[Any] | None = None


class CaseTable(Table):
    """An entry of ``specification.cases``."""

    name: str
    supports: SupportsTable
    input: InputTable
    outputs: dict[str, OutputTable]
    loads: LoadsTable = LoadsTable()


class ItemTable(Table):
    """An entry of ``specification.items``."""

    quantity: str
    case: str = ""
    output: str = ""
    of: Literal["every", "largest", "smallest", "spread"] = "every"
    start: float = 1.0
    stop: float = 1.0
    at_least: float | None = None
    at_most: float | None = None
    path: list[list[float]] | None = None


class ObjectiveTable(Table):
    """An entry of ``specification.maximise``."""

    quantity: str
    case: str = ""
    output: str = ""
    scale: float = 1.0


class TolerancesTable(Table):
    """``[specification.tolerances]``."""

    width: float
    each_width: float
    node: float
    angle: float
    least_yield: float
    keep: float = 0.0


class SpecificationTable(Table):
    """``[specification]``."""

    case: str = "case"
    output: str = "output"
    outputs: dict[str, OutputTable] = Field(default_factory=dict)
    cases: list[CaseTable] = Field(default_factory=list)
    items: list[ItemTable] = Field(default_factory=list)
    maximise: list[ObjectiveTable] = Field(default_factory=list)
    weight: list[float] | None = None
    symmetry: list[str] = Field(default_factory=list)
    domain: list[list[Any]] = Field(default_factory=list)
    tolerances: TolerancesTable | None = None


class SectionTable(Table):
    """``[section]``."""

    shape: Shape
    width: float | None = None
    thickness: float | None = None
    diameter: float | None = None
    joint: float = 0.0


class ElasticityTable(Table):
    """``[material]``."""

    young: float
    poisson: float


class ProblemTable(Table):
    """A problem file."""

    schema_: Literal["bellcrank/problem/1"] = Field(alias="schema")
    name: str
    lattice: dict[str, Any] | None = None
    positions: list[list[float]] | None = None
    beams: list[list[int]] | None = None
    supports: SupportsTable
    input: InputTable
    output: OutputTable
    stiffness: StiffnessTable = StiffnessTable()
    initial: str | None = None
    designable: list[int] | None = None
    frozen: list[Any] = Field(default_factory=list)
    aggregate: Literal["mean", "sum"] = "mean"
    objective: str | None = None
    section: SectionTable | None = None
    material: ElasticityTable | None = None
    loads: LoadsTable = LoadsTable()
    specification: SpecificationTable | None = None
    widths: list[float] | None = None
    joints: list[list[float]] | None = None
