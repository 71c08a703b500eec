"""Requests of the page and their validation."""

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

QUICK_FILES = ("stl", "3mf", "svg", "dxf", "json")
"""Files that are written quickly and do not wait behind movies and finite elements."""


class Body(BaseModel):
    """Base of all requests: unknown keys and NaN are refused."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class ErrorResponse(BaseModel):
    """Error message and the key of the request that it concerns."""

    message: str
    key: str = ""


class LatticeBody(Body):
    """Kind and parameters of a lattice."""

    lattice: dict[str, Any]


class TextBody(Body):
    """An uploaded file."""

    text: str = Field(max_length=1_900_000)
    suffix: str = Field(pattern=r"^\.[a-z0-9.]{1,12}$")


class TaskBody(Body):
    """A task with its constraints and its part."""

    problem: dict[str, Any]
    goals: Goals = ()
    part: dict[str, Any] | None = None


class SaveBody(Body):
    """A task to be written as a file."""

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
    """A design to be written as a file."""

    efficiency: float | None = None
    provenance: dict[str, Any] = Field(default_factory=dict)


class FemBody(PartBody):
    """A design to be analysed by finite elements."""

    level: Level = "frame"


class SaveDesignBody(DesignBody):
    """A design to be stored in the gallery."""

    title: str = Field(min_length=1, max_length=120)
    provenance: dict[str, Any] = Field(default_factory=dict)


class RunBody(Body):
    """A search to be started."""

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
    """The plan of a machine; its entries are names of gallery designs."""

    plan: dict[str, Any]
