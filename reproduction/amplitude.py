"""How far efficiencies hold: along the stroke, beyond it, and where structures buckle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import find_problem, gallery_design
from bellcrank.part import PartSpec
from bellcrank.plots import style
from bellcrank.workflows import with_stroke
from reproduction.checking import analyse
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
    "hand": ("by hand", style.HUMAN),
    "paper": ("paper's rule", style.BUILT),
    "part": ("for 2 mm struts", style.BEST),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Strokes, as parts of the usual one, and how the paper's designs are searched."""

    problems: tuple[str, ...] = ("crane", "anti-parallel")
    points: int = 30
    furthest: float = 3.0
    steps: int = 8000
    chains: int = 3
    frames: bool = True


def run(settings: Settings, store: ResultStore) -> Figures:
    """Follow each design along strokes, in the model and as frames."""
    strokes = np.linspace(0.0, settings.furthest, settings.points + 1)[1:].tolist()
    tasks: dict[str, Any] = {}
    for name in settings.problems:
        designs = _designs(name, settings, store)
        work = {by: partial(along, design, strokes) for by, design in designs.items()}
        tasks[name] = {
            by: {"mask": designs[by].mask_hex, "model": told}
            for by, told in store.compute_all(f"{name}-model", work).items()
        }
        if settings.frames:
            frames = {
                by: partial(as_frame, design, settings.furthest) for by, design in designs.items()
            }
            for by, told in store.compute_all(f"{name}-frame", frames).items():
                tasks[name][by]["frame"] = told
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
    """Return efficiencies at each stroke by the model, and where stability is first lost.

    What follows is not told: after a loss of stability the response is not unique.
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
    """Return the same of the design as a nonlinear frame."""
    amount = furthest * design.problem.input.amount * SCALE
    told = analyse(with_stroke(design, amount, SCALE), PartSpec(width=WIDTH), "frame")
    points = [[load * furthest, efficiency] for load, efficiency in told["stroke"]]
    lost = None
    if told["status"] != "converged":
        lost = {"stroke": told["reached"] * furthest, "status": told["lost"] or told["status"]}
    return {"points": points, "lost": lost}


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw efficiency against stroke, a panel for each task."""
    charts = []
    for name, designs in figures["tasks"].items():
        series = []
        for by, told in designs.items():
            words, colour = NAMES[by]
            strokes = np.array(figures["strokes"])
            known = np.array(
                [np.nan if v is None else v for v in told["model"]["efficiency"]], dtype=float
            )
            series.append(Series(strokes, known, name=f"{words}, model", colour=colour, width=2.0))
            if "frame" in told:
                across, up = np.array(told["frame"]["points"], dtype=float).reshape(-1, 2).T
                series.append(
                    Series(across, up, name=f"{words}, frame", colour=colour, dashed=True,
                           width=1.2)
                )  # fmt: skip
            series += _losses(told, known, strokes, colour)
        charts.append(
            Chart(name, "input motion, in strokes of the task", "efficiency", series,
                  [Level(1.0, colour=style.IDLE, upright=True)], legend=None,
                  limits_x=(0.0, figures["furthest"] * 1.02))
        )  # fmt: skip
    chart = charts[-1]
    charts[-1] = Chart(
        chart.title, chart.across, chart.up, chart.series, chart.levels, legend="upper right",
        limits_x=chart.limits_x,
    )  # fmt: skip
    sheet = Sheet(
        title="Efficiency against input stroke",
        note="1 is the stroke of the task; a dot: stability is lost; frames: struts "
        f"{figures['width']:g} mm wide on 10 mm, nonlinear",
        charts=charts,
        height=3.6,
    )
    draw_sheet(sheet, path, overwrite=True)


def _losses(
    told: Mapping[str, Any], known: np.ndarray, strokes: np.ndarray, colour: str
) -> list[Series]:
    """Return dots where stability is lost."""
    found = []
    there = np.flatnonzero(np.isfinite(known))
    if told["model"]["lost"] is not None and len(there):
        found.append((strokes[there[-1]], known[there[-1]]))
    if told.get("frame", {}).get("lost") is not None and told["frame"]["points"]:
        found.append(tuple(told["frame"]["points"][-1]))
    return [
        Series(np.array([x]), np.array([y]), kind="points", colour=colour, width=2.4, level=6.0)
        for x, y in found
        if y is not None
    ]


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    found = []
    for name, designs in figures["tasks"].items():
        for by, told in designs.items():
            found.append(
                Claim(
                    f"{name}, {NAMES[by][0]}: efficiency along the stroke",
                    "",
                    _sentence(figures["strokes"], told),
                    "strokes of the task",
                )
            )
    return found


def _sentence(strokes: list[float], told: Mapping[str, Any]) -> str:
    model = [
        (stroke, value)
        for stroke, value in zip(strokes, told["model"]["efficiency"], strict=True)
        if value is not None
    ]
    if not model:
        raise InvalidSettings("a design without any stable response along its stroke")
    words = (
        f"model {number(model[0][1])} at {model[0][0]:.1f}, {number(model[-1][1])} at "
        f"{model[-1][0]:.1f}"
    )
    if told["model"]["lost"]:
        words += f", then {told['model']['lost']['status']}"
    if "frame" in told and told["frame"]["points"]:
        last = told["frame"]["points"][-1]
        words += f"; frame {number(last[1])} at {last[0]:.1f}"
        if told["frame"]["lost"]:
            words += f", then {told['frame']['lost']['status']}"
    return words


STUDY = register(
    Study(
        name="amplitude",
        title="Efficiency against input stroke, and buckling",
        after="amplitude of the input",
        full=Settings(),
        quick=Settings(points=10, steps=1500, chains=2),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda told: (
            f"{sum(len(task) for task in told['tasks'].values())} designs at "
            f"{count(len(told['strokes']), 'stroke')}"
        ),
        deviations=("The designs are ours.",),
    )
)
