"""Requests of the page and their validation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from bellcrank.errors import UnknownName, first_line
from bellcrank.fem import levels
from bellcrank.search import DEFAULT_SEARCH, searches
from bellcrank.web.limits import CHAINS, STEPS
from bellcrank.web.page_files import page_files

if TYPE_CHECKING:
    from collections.abc import Mapping


def _name_in(registry: Mapping[str, Any]) -> AfterValidator:
    """Return a validator that refuses names that are not in a registry."""

    def check(name: str) -> str:
        try:
            registry[name]
        except UnknownName as error:
            raise ValueError(first_line(error)) from None
        return name

    return AfterValidator(check)


def _names(registry: Mapping[str, Any]) -> Any:
    """Return a field whose schema lists the names of a registry."""
    return Field(max_length=100, json_schema_extra={"enum": list(registry)})


Method = Annotated[str, _names(searches), _name_in(searches)]
FileSuffix = Annotated[str, _names(page_files), _name_in(page_files)]
Level = Annotated[str, _names(levels), _name_in(levels)]
Mask = Annotated[str, Field(pattern=r"^[0-9a-f]*$", max_length=4000)]
Session = Annotated[str, Field(pattern=r"^[a-z0-9-]{1,64}$")]
Goals = Annotated[tuple[Annotated[str, Field(max_length=100)], ...], Field(max_length=12)]


class Body(BaseModel):
    """Base of all requests: unknown keys and NaN are refused."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class ErrorResponse(BaseModel):
    """Error message and the key of the request that it concerns."""

    message: str
    key: str = ""


class TextBody(Body):
    """An uploaded file."""

    text: str = Field(max_length=1_900_000)
    suffix: str = Field(pattern=r"^\.[a-z0-9.]{1,12}$")


class TableBody(Body):
    """A task as a table, as in task files."""

    task: dict[str, Any]


class ProblemBody(Body):
    """A problem and its part."""

    problem: dict[str, Any]
    part: dict[str, Any] = Field(default_factory=dict)


class DesignBody(Body):
    """A design."""

    problem: dict[str, Any]
    mask: Mask


class MotionBody(DesignBody):
    """A design that moves in one of its load cases, the first one by default."""

    case: str = Field(default="", max_length=120)


class PartBody(DesignBody):
    """A design as a part."""

    part: dict[str, Any] = Field(default_factory=dict)


class GripBody(PartBody):
    """A design as a part, with additions for clamping and pushing.

    In the plane the supports can be filled to a plate with screw holes, and the input and the
    output to pads.
    """

    plate: bool = False
    screws: int = Field(default=0, ge=0, le=12)
    pad: bool = False
    output_pad: bool = False

    @property
    def grips(self) -> dict[str, Any]:
        """Arguments of `bellcrank.workflows.fabricate.Grips`."""
        names = ("plate", "screws", "pad", "output_pad")
        return {name: getattr(self, name) for name in names}


class FileBody(GripBody):
    """A design to be written as a file."""

    efficiency: float | None = None
    provenance: dict[str, Any] = Field(default_factory=dict)


class FemBody(PartBody):
    """A design to be analysed by finite elements."""

    level: Level = "frame"


class ComputationsBody(PartBody):
    """A design whose slow computations are listed, with their results or without."""

    results: bool = True


class StopBody(PartBody):
    """A design of which the tolerance, or the finite elements of a level, are stopped."""

    computation: Literal["validation", "tolerance"]
    level: Level = "frame"


class SaveDesignBody(DesignBody):
    """A design to be stored in the gallery."""

    title: str = Field(min_length=1, max_length=120)
    provenance: dict[str, Any] = Field(default_factory=dict)


class RunBody(Body):
    """A search to be started, for a task with a specification or for a problem.

    It begins with the design ``start``, by default with the full lattice. With ``refine``, this
    design is refined, without a search; with ``tolerant``, over the usual tolerances unless it has
    its own.
    """

    title: str = Field(min_length=1, max_length=120)
    session: Session
    task: dict[str, Any] | None = None
    problem: dict[str, Any] | None = None
    method: Method = DEFAULT_SEARCH
    steps: int = Field(default=25_000, ge=1, le=STEPS)
    chains: int = Field(default=2, ge=1, le=CHAINS)
    seed: int = Field(default=0, ge=0, lt=2**53)
    goals: Goals = ()
    part: dict[str, Any] | None = None
    reference: Mask | None = None
    start: Mask | None = None
    refine: bool = False
    tolerant: bool = False

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.task is None) == (self.problem is None):
            raise ValueError("expected either a task or a problem")
        if self.task is not None and self.part is not None:
            raise ValueError("the part is that of the task")
        if self.refine and self.start is None:
            raise ValueError("start: expected the design to be refined")
        if self.tolerant and not self.refine:
            raise ValueError("tolerant: expected a refinement")
        return self


class PlanBody(Body):
    """The plan of a machine; its entries are names of gallery designs."""

    plan: dict[str, Any]
