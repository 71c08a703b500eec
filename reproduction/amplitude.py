"""Efficiency along the stroke and beyond it, and loss of stability."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import find_problem, gallery_design
from bellcrank.part import PartSpec
from bellcrank.plots import style
from bellcrank.workflows import with_stroke
from reproduction.finite_elements import analyse
from reproduction.formatting import count, number
from reproduction.pictures.charts import Chart, Level, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import best_design, design_of, respond, run_chains

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from bellcrank.model import Design
    from reproduction.result_store import ResultStore

WIDTH, SCALE = 2.0, 10.0
NAMES = {
    "hand": ("human", style.HUMAN),
    "paper": ("paper's search", style.BUILT),
    "part": ("2 mm struts", style.BEST),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Strokes as multiples of that of the task, and settings of the paper's search."""

    problems: tuple[str, ...] = ("crane", "anti-parallel")
    points: int = 30
    furthest: float = 3.0
    steps: int = 8000
    chains: int = 3
    frames: bool = True


def run(settings: Settings, store: ResultStore) -> Figures:
    """Compute each design along the stroke, in the model of its search and as a frame."""
    strokes = np.linspace(0.0, settings.furthest, settings.points + 1)[1:].tolist()
    tasks: dict[str, Any] = {}
    for name in settings.problems:
        designs = _designs(name, settings, store)
        work = {by: partial(along, design, strokes) for by, design in designs.items()}
        tasks[name] = {
            by: {"mask": designs[by].mask_hex, "model": row}
            for by, row in store.compute_all(f"{name}-model", work).items()
        }
        if settings.frames:
            frames = {
                by: partial(as_frame, design, settings.furthest) for by, design in designs.items()
            }
            for by, row in store.compute_all(f"{name}-frame", frames).items():
                tasks[name][by]["frame"] = row
    return {
        "strokes": strokes,
        "furthest": settings.furthest,
        "width": WIDTH,
        "chains": settings.chains,
        "steps": settings.steps,
        "tasks": tasks,
    }


def _designs(name: str, settings: Settings, store: ResultStore) -> dict[str, Design]:
    problem = find_problem(name)
    search = {"search": "paper", "steps": settings.steps}
    chains = run_chains(store, f"{name}-chain", problem, search, settings.chains)
    found = {
        "hand": gallery_design("human", name),
        "paper": design_of(problem, best_design(problem, chains).design.mask_hex),
        "part": gallery_design("machine", name),
    }
    return {by: design for by, design in found.items() if design is not None}


def along(design: Design, strokes: list[float]) -> dict[str, Any]:
    """Return efficiencies in the model of the search, and the first loss of stability.

    Efficiencies after a loss of stability are None, because the response is not unique.
    """
    efficiency: list[float | None] = []
    lost = None
    for stroke in strokes:
        response = respond(design, stroke)
        if lost is None and not response.is_admissible:
            lost = {"stroke": stroke, "status": response.status.label}
        efficiency.append(response.efficiency if lost is None else None)
    return {"efficiency": efficiency, "lost": lost}


def as_frame(design: Design, furthest: float) -> dict[str, Any]:
    """Return the same for the design as a nonlinear frame."""
    amount = furthest * design.problem.input.amount * SCALE
    row = analyse(with_stroke(design, amount, SCALE), PartSpec(width=WIDTH), "frame")
    points = [[load * furthest, efficiency] for load, efficiency in row["stroke"]]
    lost = None
    if row["status"] != "converged":
        lost = {"stroke": row["reached"] * furthest, "status": row["lost"] or row["status"]}
    return {"points": points, "lost": lost}


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the efficiency against the stroke, one chart for each task."""
    charts = []
    for name, designs in figures["tasks"].items():
        series = []
        for by, row in designs.items():
            label, colour = NAMES[by]
            strokes = np.array(figures["strokes"])
            known = np.array(
                [np.nan if v is None else v for v in row["model"]["efficiency"]], dtype=float
            )
            series.append(Series(strokes, known, name=f"{label}, model", colour=colour, width=2.0))
            if "frame" in row:
                x, y = np.array(row["frame"]["points"], dtype=float).reshape(-1, 2).T
                series.append(
                    Series(x, y, name=f"{label}, frame", colour=colour, dashed=True,
                           width=1.2)
                )  # fmt: skip
            series += _losses(row, known, strokes, colour)
        charts.append(
            Chart(name, "input displacement / stroke of the task", "efficiency", series,
                  [Level(1.0, colour=style.IDLE, vertical=True)], legend=None,
                  limits_x=(0.0, figures["furthest"] * 1.02))
        )  # fmt: skip
    charts[-1] = replace(charts[-1], legend="upper right")
    sheet = Sheet(
        title="Efficiency against input stroke",
        note="dots mark the loss of stability; nonlinear frames with struts "
        f"{figures['width']:g} mm wide, spacing 10 mm",
        charts=charts,
        height=3.6,
    )
    draw_sheet(sheet, path, overwrite=True)


def _losses(
    row: Mapping[str, Any], known: np.ndarray, strokes: np.ndarray, colour: str
) -> list[Series]:
    """Return dots at losses of stability."""
    found = []
    there = np.flatnonzero(np.isfinite(known))
    if row["model"]["lost"] is not None and len(there):
        found.append((strokes[there[-1]], known[there[-1]]))
    if row.get("frame", {}).get("lost") is not None and row["frame"]["points"]:
        found.append(tuple(row["frame"]["points"][-1]))
    return [
        Series(np.array([x]), np.array([y]), kind="points", colour=colour, width=2.4, level=6.0)
        for x, y in found
        if y is not None
    ]


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    found = []
    for name, designs in figures["tasks"].items():
        for by, row in designs.items():
            found.append(
                Claim(
                    f"{name}, {NAMES[by][0]}: efficiency",
                    "",
                    _sentence(figures["strokes"], row),
                    "in multiples of the stroke of the task",
                )
            )
    return found


def _sentence(strokes: list[float], row: Mapping[str, Any]) -> str:
    model = [
        (stroke, value)
        for stroke, value in zip(strokes, row["model"]["efficiency"], strict=True)
        if value is not None
    ]
    if not model:
        raise InvalidSettings("amplitude: a design has no stable response")
    text = (
        f"model {number(model[0][1])} at {model[0][0]:.1f}, {number(model[-1][1])} at "
        f"{model[-1][0]:.1f}"
    )
    if row["model"]["lost"]:
        text += f", then {row['model']['lost']['status']}"
    if "frame" in row and row["frame"]["points"]:
        last = row["frame"]["points"][-1]
        text += f"; frame {number(last[1])} at {last[0]:.1f}"
        if row["frame"]["lost"]:
            text += f", then {row['frame']['lost']['status']}"
    return text


STUDY = register(
    Study(
        name="amplitude",
        title="Efficiency against input stroke, and loss of stability",
        after="amplitude of the input",
        full=Settings(),
        quick=Settings(points=10, steps=1500, chains=2),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda figures: (
            f"{sum(len(task) for task in figures['tasks'].values())} designs at "
            f"{count(len(figures['strokes']), 'stroke')}"
        ),
        deviations=("The designs are ours.",),
    )
)
