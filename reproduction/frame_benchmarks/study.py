"""Study: published benchmarks of frames under large displacements."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction.formatting import count
from reproduction.frame_benchmarks.definition import benchmarks, pushing_force
from reproduction.frame_benchmarks.plane import (
    HALF_SPAN,
    LEE_LENGTH,
    RADIUS,
    arch_frame,
    lee_frame,
    toggle_frame,
)
from reproduction.frame_benchmarks.space import RING_RADIUS, ring
from reproduction.pictures.charts import Chart, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.frame_benchmarks.definition import Benchmark
    from reproduction.result_store import ResultStore

KINDS = {"linear": False, "bowed": True}
"""Elements: linear in their deformations; shorter when they bend, as those of searches."""
PATHS = {
    "lee-frame": (lee_frame, 40, 58.0, LEE_LENGTH, "Lee's frame"),
    "toggle": (toggle_frame, 32, 0.6, HALF_SPAN, "Williams' toggle"),
    "arch": (arch_frame, 80, 118.0, RADIUS, "deep arch"),
}
"""Curves of the force: frame, elements, last deflection, length, name."""
RING_ELEMENTS = 96
COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#1a1d21", "#8f98a1",
    "#7a4fa3", "#a6761d", "#b22222",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Benchmarks, their numbers of elements, and the number of points of curves."""

    names: tuple[str, ...] = tuple(benchmarks.names())
    full: bool = True
    points: int = 60


def run(settings: Settings, store: ResultStore) -> Figures:
    """Compute the benchmarks, their exact solutions and the curves."""
    chosen = {name: benchmarks[name] for name in settings.names}
    work = {name: partial(convergence, each, full=settings.full) for name, each in chosen.items()}
    figures: Figures = {"benchmarks": store.compute_all("benchmark", work)}
    curves: dict[str, Any] = {
        name: partial(path_of, name, settings.points) for name in PATHS if name in chosen
    }
    if "ring" in chosen:
        curves["ring"] = partial(ring_path, settings.points)
    figures["paths"] = store.compute_all("path", curves)
    return figures


def convergence(benchmark: Benchmark, *, full: bool) -> dict[str, Any]:
    """Return the quantities with each number and kind of elements, and their relative errors.

    The reference is the exact solution, else the first converged published figure. The limit of
    many elements follows from the last two numbers, for errors of second order (Richardson).
    """
    numbers = benchmark.full if full else benchmark.quick
    exact = None if benchmark.exact is None else benchmark.exact()
    reference = np.array(exact if exact is not None else converged_figures(benchmark))
    found: dict[str, Any] = {
        "quantities": list(benchmark.quantities),
        "elements": list(numbers),
        "exact": exact,
        "published": [
            {
                "values": list(each.values), "digits": each.digits, "source": each.source,
                "elements": each.elements,
            }
            for each in benchmark.published
        ],
    }  # fmt: skip
    for kind, bowed in KINDS.items():
        values = np.array([benchmark.compute(number, bowed) for number in numbers])
        limit = (4.0 * values[-1] - values[-2]) / 3.0
        found[kind] = {
            "values": values.tolist(),
            "errors": (values / reference - 1.0).tolist(),
            "limit": limit.tolist(),
            "limit_errors": (limit / reference - 1.0).tolist(),
        }
    return found


def converged_figures(benchmark: Benchmark) -> list[float]:
    """Return the published figures that do not depend on a number of elements."""
    first = next(each for each in benchmark.published if each.elements is None)
    return [math.nan if value is None else value for value in first.values]


def path_of(name: str, points: int) -> dict[str, Any]:
    """Return the force along the deflection, which is prescribed."""
    frame, number, last, length, _ = PATHS[name]
    deflections = last * np.arange(1, points + 1) / points
    return {
        "deflection": [0.0, *(deflections / length).tolist()],
        "force": [0.0, *(pushing_force(frame(number, float(each))) for each in deflections)],
    }


def ring_path(points: int) -> dict[str, Any]:
    """Return the moment of the ring along its turn, and the lowest stiffness."""
    turned = RING_ELEMENTS // 2
    turns = 2.0 * math.pi * np.arange(1, points + 1) / points
    states = [ring(RING_ELEMENTS, float(turn)) for turn in turns]
    return {
        "turn_deg": [0.0, *np.degrees(turns).tolist()],
        "moment": [0.0, *(float(each.force[turned, 3]) for each in states)],
        "displacement": [
            0.0, *(-float(each.displacement[turned, 0]) / RING_RADIUS for each in states)
        ],
        "softest": states[-1].softest,
    }  # fmt: skip


def largest(errors: list[list[float]]) -> list[float]:
    """Return the largest error of any quantity with each number of elements."""
    return [max(abs(each) for each in row) for row in errors]


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the errors of both elements, and curves of the force and of the moment."""
    rows = figures["benchmarks"]
    charts = []
    for kind, title in (("linear", "Linear elements"), ("bowed", "Elements with bowing")):
        series = [
            Series(
                np.array(row["elements"], dtype=float),
                100.0 * np.maximum(largest(row[kind]["errors"]), 1e-9),
                kind="both", colour=COLOURS[list(benchmarks).index(name)], width=1.3,
                name=name, dashed=benchmarks[name].dimension == 3,
            )
            for name, row in rows.items()
        ]  # fmt: skip
        charts.append(
            Chart(
                title,
                "elements",
                "largest error, %",
                series,
                log_x=True,
                log_y=True,
                limits_y=(1e-7, 5.0),
                legend="lower left" if kind == "linear" else None,
            )
        )
    charts.append(_force_chart(figures["paths"]))
    draw_sheet(
        Sheet(
            title="Published benchmarks of large displacements",
            note="errors relative to exact solutions, for the right-angle frame to its published "
            "load; dashed: in space",
            charts=charts,
            height=3.6,
        ),
        path,
        overwrite=True,
    )


def _force_chart(paths: Mapping[str, Any]) -> Chart:
    """Return the forces and the moment along the prescribed motion."""
    series = []
    for name, row in paths.items():
        of_ring = name == "ring"
        along = np.array(row["turn_deg" if of_ring else "deflection"])
        force = np.array(row["moment" if of_ring else "force"])
        label = "ring: moment by turn" if of_ring else PATHS[name][4]
        colour = COLOURS[list(benchmarks).index(name)]
        series.append(
            Series(along / along[-1], force / force.max(), name=label, colour=colour, width=1.6)
        )
    return Chart(
        "Force along the motion", "motion, part of the last", "force, part of the largest", series,
        legend="lower center",
    )  # fmt: skip


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with exact solutions and published figures."""
    rows = []
    for name, row in figures["benchmarks"].items():
        benchmark = benchmarks[name]
        for k, quantity in enumerate(row["quantities"]):
            errors = {kind: row[kind]["errors"][-1][k] for kind in KINDS}
            rows.append(
                Claim(
                    f"{benchmark.title}: {quantity}",
                    reference_text(row, k),
                    f"{row['linear']['values'][-1][k]:.6g}",
                    f"{row['elements'][-1]} elements; error {percent(errors['linear'])}, with "
                    f"bowing {percent(errors['bowed'])}",
                )
            )
    return rows


def reference_text(row: Mapping[str, Any], quantity: int) -> str:
    """Return the exact value and converged published ones of a quantity."""
    parts = [] if row["exact"] is None else [f"{row['exact'][quantity]:.6g} (exact)"]
    parts += [
        f"{each['values'][quantity]:.{each['digits']}f} (published)"
        for each in row["published"]
        if each["elements"] is None
    ]
    return "; ".join(parts)


def percent(error: float) -> str:
    """Format a relative error.

    Examples
    --------
    >>> percent(-0.000351), percent(2e-9)
    ('-0.035 %', '< 0.0001 %')
    """
    value = 100.0 * error
    if abs(value) < 5e-5:
        return "< 0.0001 %"
    return f"{value:.{4 if abs(value) < 0.01 else 3 if abs(value) < 1.0 else 2}f} %"


STUDY = register(
    Study(
        name="benchmarks",
        title="Published benchmarks of frames under large displacements",
        after="not part of the paper",
        page="benchmarks",
        full=Settings(),
        quick=Settings(full=False, points=16),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda figures: count(len(figures["benchmarks"]), "benchmark"),
    )
)
