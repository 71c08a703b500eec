"""Report of a design job: its figures, summary and pictures in the result folder."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.mechanics import objective_name
from bellcrank.model.storage import write_text

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.mechanics import Response
    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.search import SearchSettings, Selection
    from bellcrank.storage import RunFolder
    from bellcrank.workflows.validation import Validation


RESULTS = re.compile(
    r"(design|validation)\.json|summary\.(md|json)|(comparison|efficiency|motion)\.png"
)
"""Names of the result files of a design job."""


AGREEMENT = 1e-6
"""Largest difference between the efficiencies of two loading paths that verify each other, relative
to the efficiency, or to 1 where that is less."""


@dataclass(frozen=True, slots=True, eq=False)
class DesignReport:
    """Result of a design job.

    Parameters
    ----------
    folder
        Result folder.
    settings
        Settings of the search.
    selection
        Chosen design and its origin.
    checks
        Efficiency of the design from rest, by the load increments that it was computed in.
    initial_efficiency
        Efficiency of the initial design by the same objective; nan if it has none.
    human
        Human design of the same problem, if there is one.
    human_response
        Response of the human design by the same objective.
    proposals, best_by_chain
        Number of designs evaluated; best efficiency that each chain accepted.
    part
        Part for which the design was searched, if any.
    validation
        Frame analysis of that part, if all its pieces are supported.
    """

    folder: Path
    settings: SearchSettings
    selection: Selection
    checks: dict[str, float]
    initial_efficiency: float
    human: Design | None
    human_response: Response | None
    proposals: int
    best_by_chain: list[float]
    part: PartSpec | None = None
    validation: Validation | None = None

    @property
    def failures(self) -> list[str]:
        """Reasons why the design does not work; empty if it does."""
        found = []
        if self.selection.efficiency_after <= 0.0:
            found.append("the output does not move in the wanted direction")
        if self.part is not None:
            if self.validation is None:
                found.append("the part is not held by any support")
            else:
                found += self.validation.analyses[0].warnings
        return found

    @property
    def agreement(self) -> float:
        """Largest difference between the checks."""
        return max(self.checks.values()) - min(self.checks.values())

    @property
    def verified(self) -> bool:
        """Whether the checks agree."""
        return self.agreement <= AGREEMENT * max(1.0, *map(abs, self.checks.values()))


def summary_data(report: DesignReport) -> dict[str, Any]:
    """Return the figures of a report as plain data (``summary.json``)."""
    selection = report.selection
    human = report.human_response
    return {
        "schema": "bellcrank/summary/1",
        "problem": selection.design.problem.name,
        "efficiency": selection.efficiency_after,
        "efficiency_before_cleaning": selection.efficiency_before,
        "status": selection.response.status.label,
        "beams": selection.design.beam_count,
        "mask": selection.design.mask_hex,
        "checks": report.checks,
        "verified": report.verified,
        "initial_efficiency": _finite(report.initial_efficiency),
        "human_efficiency": human.efficiency if human else None,
        "as_part": _as_part(report),
        "found": {
            "chain": selection.found.chain,
            "step": selection.found.step,
        },
        "refused_candidates": selection.refused,
        "proposals": report.proposals,
        "best_by_chain": [_finite(best) for best in report.best_by_chain],
        "settings": report.settings.to_dict(),
    }


def _as_part(report: DesignReport) -> dict[str, Any] | None:
    """Return the figures of the frame analysis as plain data."""
    if report.validation is None:
        return None
    data = report.validation.to_dict()["results"][0]
    figures = ("level", "theory", "status", "efficiency", "von_mises_MPa", "principal_strain")
    return {key: data[key] for key in (*figures, "contacts", "warnings", "part")}


def part_rows(report: DesignReport) -> list[tuple[str, str]]:
    """Return the figures of the frame analysis as rows of a name and a value."""
    if report.part is None:
        return []
    name = f"frame of {report.part.width:g} mm struts"
    if report.validation is None:
        return [(name, "not analysed: a piece is not supported")]
    analysis = report.validation.analyses[0]
    if not math.isfinite(analysis.efficiency):
        return [(name, f"not stable: {analysis.status.message}")]
    last = analysis.last
    first = analysis.contacts.first
    contact = "no contact" if first is None else f"contact from {first:.0%} of the stroke"
    return [
        (f"efficiency, {name}", f"{analysis.efficiency:.4f}"),
        (
            "largest stress and strain, frame",
            f"{last.stress:.2g} MPa, {last.strain:.0%}; {contact}",
        ),
    ]


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None


def summary_text(report: DesignReport) -> str:
    """Return the summary as Markdown (``summary.md``)."""
    selection = report.selection
    initial = ("initial design", f"{report.initial_efficiency:.6f}")
    objective = objective_name(selection.design.problem)
    rows = [
        (f"efficiency ({objective}), spring model", f"{selection.efficiency_after:.6f}"),
        *part_rows(report),
        ("before cleaning", f"{selection.efficiency_before:.6f}"),
        initial,
        *((f"from rest by {name}", f"{value:.9f}") for name, value in report.checks.items()),
        ("beams", str(selection.design.beam_count)),
        ("found by chain, at step", f"{selection.found.chain}, {selection.found.step}"),
        ("designs evaluated", str(report.proposals)),
    ]
    if report.settings.goals:
        rows.append(("goals satisfied", ", ".join(report.settings.goals).replace("|", "/")))
    if report.human_response is not None:
        human = ("human design", f"{report.human_response.efficiency:.6f}")
        rows.insert(rows.index(initial) + 1, human)
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    refused = "".join(
        f"\nNot chosen, though better in the spring model: {count} ({reason})."
        for reason, count in selection.refused.items()
    )
    return f"""# {selection.design.problem.name}

| | |
|---|---|
{table}

Cleaning removes beams without load: loose pieces, dead ends, and pieces that are connected by a
single node or to supports only. Dead ends soften joints in the spring model but not in a real part,
so the efficiency after cleaning is the one to expect.
{refused}
![the design at rest and displaced](motion.png)

![efficiency along the chains](efficiency.png)
"""


def write_report(report: DesignReport, folder: RunFolder) -> None:
    """Write ``summary.json`` and ``summary.md`` into the result folder."""
    path = folder.path
    write_text(path / "summary.json", json.dumps(summary_data(report), indent=1), overwrite=True)
    write_text(path / "summary.md", summary_text(report), overwrite=True)
