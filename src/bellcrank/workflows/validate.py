"""Does the part move as its design says? Finite elements, and a record of what they said."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.fem import FemSettings, levels
from bellcrank.fem.results import finite
from bellcrank.mechanics import CAREFUL, Evaluator, Response
from bellcrank.model.parsing import read_json
from bellcrank.model.storage import write_text
from bellcrank.parts import PartSpec, read_length
from bellcrank.parts.pieces import require_held
from bellcrank.provenance import provenance

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from bellcrank.fem import Analysis
    from bellcrank.model import Design

SCHEMA = "bellcrank/validation/1"


@dataclass(frozen=True, slots=True, eq=False)
class Validation:
    """A design, its part, and what each analysis says.

    Parameters
    ----------
    design
        With the stroke that was asked for.
    spec
        Of the part.
    response
        Of the discrete model, with the stiffness that the design's problem gives.
    analyses
        In the order of levels and theories.
    """

    design: Design
    spec: PartSpec
    response: Response
    analyses: list[Analysis]

    def entries(self) -> list[dict[str, Any]]:
        """Return the analyses as plain data, each with the part it was made for."""
        given = self.design.problem.input
        stroke = given.amount * self.spec.scale if given.drive == "displacement" else None
        part = {**self.spec.to_dict(), "stroke": stroke}
        return [{**analysis.to_dict(), "part": part} for analysis in self.analyses]

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain data; the figures of the first analysis stand at the top."""
        first = self.analyses[0].to_dict()
        top = (
            "level", "theory", "linear", "status", "reached", "efficiency",
            "mean_output_displacement_mm", "input_force_N", "energy_N_mm", "von_mises_MPa",
            "principal_strain",
        )  # fmt: skip
        return {
            "schema": SCHEMA,
            "problem": self.design.problem.name,
            "mask": self.design.mask_hex,
            **{key: first[key] for key in top},
            "discrete_model": {
                "efficiency": finite(self.response.efficiency),
                "status": self.response.status.label,
                "stiffness": {
                    "bond": self.design.problem.stiffness.bond,
                    "angle": self.design.problem.stiffness.angle,
                },
            },
            "results": self.entries(),
            "provenance": provenance(),
        }


def spec_for(design: Design) -> PartSpec:
    """Return the part that a design was searched for, or the default one."""
    return PartSpec.from_dict(design.provenance.get("part") or {})


def with_stroke(design: Design, stroke: str | float, scale: float) -> Design:
    """Return a design whose input moves so far.

    Raises
    ------
    InvalidSettings
        If that is no length above 0, or a force drives the input.
    """
    length = read_length("stroke", stroke)
    given = design.problem.input
    if given.drive != "displacement":
        raise InvalidSettings(
            f"stroke: {design.problem.name!r} is driven by a force, not by a motion"
        )
    if length <= 0.0:
        raise InvalidSettings(f"stroke: expected a length above 0 mm, got {length:g}")
    driven = replace(given, amount=length / scale)
    return replace(design, problem=replace(design.problem, input=driven))


def validate(
    design: Design,
    spec: PartSpec,
    plan: Sequence[tuple[str, FemSettings]],
    tell: Callable[[int, float], None] = lambda _index, _load: None,
    keep: Callable[[Validation], None] = lambda _so_far: None,
) -> Validation:
    """Analyse a design as a part.

    Parameters
    ----------
    spec
        Size and material.
    plan
        Levels with settings, in the order wanted.
    tell
        Called with the index in the plan and the part of the stroke that is reached.
    keep
        Called after each analysis with all so far, so that a kill during the next costs no more.

    Raises
    ------
    InvalidSettings, UnknownName
        If the part cannot be built or analysed.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> crane = human_design("crane")
    >>> found = validate(crane, PartSpec(), [("frame", FemSettings())])
    >>> round(found.analyses[0].efficiency, 3)
    1.21
    """
    chosen = [levels[name] for name, _ in plan]  # before anything is computed
    part = spec.of(design)
    require_held(design)
    response = Evaluator(design.problem).respond(design.mask, CAREFUL)
    found = Validation(design, spec, response, [])
    for index, (analyse, (_, settings)) in enumerate(zip(chosen, plan, strict=True)):
        analysis = analyse(part, settings, lambda load, index=index: tell(index, load))
        found = replace(found, analyses=[*found.analyses, analysis])
        keep(found)
    return found


def keep_record(validation: Validation, path: Path) -> None:
    """Put a validation into the record of its design: other analyses stay, the same are renewed.

    Raises
    ------
    InvalidFile
        If there is something else of that name.
    StorageError
        If it cannot be written.
    """
    data = validation.to_dict()
    kept: list[dict[str, Any]] = []
    if path.exists():
        old = read_json(path)
        if old.get("schema") != SCHEMA:
            raise InvalidFile(f"{path}: expected a record of {SCHEMA}, which may be renewed")
        if (old.get("problem"), old.get("mask")) == (data["problem"], data["mask"]):
            renewed = [_key(entry) for entry in data["results"]]
            kept = [entry for entry in old["results"] if _key(entry) not in renewed]
    record = {key: data[key] for key in ("schema", "problem", "mask", "discrete_model")}
    record |= {"results": [*kept, *data["results"]], "provenance": data["provenance"]}
    write_text(path, json.dumps(record, indent=1) + "\n", overwrite=True)


def _key(entry: dict[str, Any]) -> str:
    """Return what makes two analyses the same."""
    return json.dumps([entry[key] for key in ("level", "theory", "linear", "part")], sort_keys=True)
