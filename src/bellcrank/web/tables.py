"""What a page may send, checked once."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from bellcrank.web.limits import CHAINS, STEPS

Method = Literal["basin-hopping", "tempering", "paper"]
FileSuffix = Literal["stl", "3mf", "svg", "dxf", "step", "mp4", "gif", "pdf", "json"]
Level = Literal["frame", "plane", "solid"]
Mask = Annotated[str, Field(pattern=r"^[0-9a-f]*$", max_length=4000)]
Session = Annotated[str, Field(pattern=r"^[a-z0-9-]{1,64}$")]
Goals = Annotated[tuple[Annotated[str, Field(max_length=100)], ...], Field(max_length=12)]

MEDIA = {
    "stl": "model/stl",
    "3mf": "model/3mf",
    "svg": "image/svg+xml",
    "dxf": "image/vnd.dxf",
    "step": "model/step",
    "mp4": "video/mp4",
    "gif": "image/gif",
    "pdf": "application/pdf",
    "json": "application/json",
}

SWIFT = ("stl", "3mf", "svg", "dxf", "json")
"""Files that take a moment, and need not wait behind movies and finite elements."""


class Body(BaseModel):
    """A request: no unknown keys, no NaN."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class Complaint(BaseModel):
    """What is wrong, in a sentence, and which part of the request it is about."""

    message: str
    key: str = ""


class LatticeBody(Body):
    """A lattice by its kind and parameters."""

    lattice: dict[str, Any]


class TextBody(Body):
    """A file that a person picked."""

    text: str = Field(max_length=1_900_000)
    suffix: str = Field(pattern=r"^\.[a-z0-9.]{1,12}$")


class TaskBody(Body):
    """A task, with what its design must keep and the part that it is for."""

    problem: dict[str, Any]
    goals: Goals = ()
    part: dict[str, Any] | None = None


class SaveBody(Body):
    """A task to be written as text."""

    problem: dict[str, Any]
    lattice: dict[str, Any] | None = None
    suffix: Literal[".json", ".toml"]


class DesignBody(Body):
    """A design."""

    problem: dict[str, Any]
    mask: Mask


class PartBody(DesignBody):
    """A design as a part."""

    part: dict[str, Any] = Field(default_factory=dict)


class FileBody(PartBody):
    """A design of which a file is wanted."""

    efficiency: float | None = None
    provenance: dict[str, Any] = Field(default_factory=dict)


class FemBody(PartBody):
    """A design to be analysed by finite elements."""

    level: Level = "frame"


class KeepBody(DesignBody):
    """A design to be kept in the gallery."""

    title: str = Field(min_length=1, max_length=120)
    provenance: dict[str, Any] = Field(default_factory=dict)


class RunBody(Body):
    """A search to be made."""

    title: str = Field(min_length=1, max_length=120)
    session: Session
    problem: dict[str, Any]
    method: Method = "basin-hopping"
    steps: int = Field(default=20_000, ge=1, le=STEPS)
    chains: int = Field(default=4, ge=1, le=CHAINS)
    seed: int = Field(default=0, ge=0, lt=2**53)
    goals: Goals = ()
    part: dict[str, Any] | None = None
    reference: Mask | None = None


class PlanBody(Body):
    """A machine: the plan, whose entries are names in the gallery."""

    plan: dict[str, Any]
