"""Study: a printed triangular lattice that others measured, by springs, frames and the sheet."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.plots import style
from reproduction.formatting import count
from reproduction.measured.comparison import (
    EFFECTS,
    compared,
    effect,
    gradients,
    noise,
    outputs,
    own_weight,
    scattered,
)
from reproduction.measured.lattice import MODELS
from reproduction.pictures.charts import Chart, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.result_store import ResultStore

BEST = "frame-clamped-nonlinear"
"""Model of the picture."""
AREA = 1e9
"""Gradients are shown in 1e-9 m^2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Models, and the number of lattices with random widths and positions."""

    models: tuple[str, ...] = tuple(MODELS)
    effects: tuple[str, ...] = tuple(EFFECTS)
    samples: int = 400
    density: float = 1.1
    width: float = 0.05
    position: float = 0.1


def run(settings: Settings, store: ResultStore) -> Figures:
    """Compare the models with the measurements, and vary the sample.

    Models of the sheet are left out where NGSolve is not installed.
    """
    sheets = importlib.util.find_spec("ngsolve") is not None
    chosen = [name for name in settings.models if sheets or MODELS[name].kind != "sheet"]
    effects = [name for name in settings.effects if sheets or name != "sheet"]
    # All threads share one heap of NGSolve.
    models = store.compute_all(
        "model", {name: partial(compared, MODELS[name]) for name in chosen}, workers=1
    )
    changes = store.compute_all(
        "effect",
        {
            **{name: partial(effect, name) for name in effects},
            "own-weight": partial(own_weight, settings.density),
        },
        workers=1,
    )
    random = store.compute(
        "scattered", partial(scattered, settings.samples, settings.width, settings.position)
    )
    measured = outputs()
    return {
        "outputs_mm": (1e3 * measured.values).tolist(),
        "uncertainty_mm": (1e3 * measured.uncertainty).tolist(),
        "mean_mm": 1e3 * measured.mean,
        "gradients": {
            each.name: {"values": each.values.tolist(), "uncertainty": each.uncertainty.tolist()}
            for each in gradients()
        },
        "models": models,
        "effects": [*changes.values(), *random],
        "samples": settings.samples,
        "noise": noise(),
    }


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the outputs of all models, and the gradients of one beside the measurement."""
    models = figures["models"]
    shown = BEST if BEST in models else list(models)[-1]
    charts = [_outputs_chart(figures)]
    titles = {"main": "Gradients, 5 g and 10 g", "supplement": "Gradients, 10 g twice"}
    for name, measured in figures["gradients"].items():
        values = AREA * np.array(measured["values"])
        spread = AREA * np.array(measured["uncertainty"])
        series = [
            Series(
                AREA * np.array(models[kind]["matching"][name]["values"]), values, kind="points",
                name=label, colour=colour, low=values - spread if bars else None,
                high=values + spread if bars else None, width=1.2,
            )
            for kind, label, colour, bars in (
                ("bars", "bars", style.IDLE, False),
                (shown, title_of(shown), style.BEST, True),
            )
            if kind in models
        ]  # fmt: skip
        ends = np.array([min(values.min(), 0.0), values.max()]) * 1.1
        series.append(Series(ends, ends, colour=style.INK, width=0.9, dashed=True, level=1.0))
        charts.append(
            Chart(
                titles[name], "computed, 10⁻⁹ m²", "measured, 10⁻⁹ m²", series, legend="lower right"
            )
        )
    draw_sheet(
        Sheet(
            title="A printed triangular lattice, measured by others",
            note="gradients: modulus from the outputs; vertical lines: stated uncertainty. "
            "Measurements: S. Li and X. Mao 2024",
            charts=charts,
            height=3.4,
        ),
        path,
        overwrite=True,
    )


def _outputs_chart(figures: Mapping[str, Any]) -> Chart:
    """Return the outputs of the models, with the modulus of the source."""
    models = figures["models"]
    values = [-float(np.mean(row["nominal"]["outputs_mm"])) for row in models.values()]
    size = -figures["mean_mm"]
    spread = figures["uncertainty_mm"][1]
    series = [
        Series(
            np.arange(len(values), dtype=float), np.array(values), kind="points", width=1.6,
            colour=style.BEST, name="models",
        ),
        Series(
            np.array([-0.5, len(values) - 0.5]), np.full(2, size), colour=style.HUMAN,
            low=np.full(2, size - spread), high=np.full(2, size + spread), name="measured",
        ),
    ]  # fmt: skip
    names = [SHORT[name] for name in models]
    return Chart(
        "Displacement of the outputs", "bars, springs, frames, sheet", "mm", series,
        names=names, legend="lower left",
        limits_y=(min(values) - 0.02, max(*values, size + spread) + 0.01),
    )  # fmt: skip


SHORT = {
    "bars": "B", "springs": "S", "frame-free-linear": "F1", "frame-free-nonlinear": "F2",
    "frame-clamped-linear": "F3", "frame-clamped-nonlinear": "F4", "sheet-free-linear": "P1",
    "sheet-free-nonlinear": "P2", "sheet-clamped-linear": "P3", "sheet-clamped-nonlinear": "P4",
}  # fmt: skip
"""Labels of the models in the picture."""


TITLES = {
    "bars": "bars, hinged", "springs": "springs of the paper", "frame": "frames", "sheet": "sheet",
}  # fmt: skip
"""Names of the kinds of models in tables."""


def title_of(name: str) -> str:
    """Return the name of a model in tables."""
    model = MODELS[name]
    if model.kind in {"bars", "springs"}:
        return TITLES[model.kind]
    support = "clamped" if model.clamped else "free to turn"
    return f"{TITLES[model.kind]}, {support}, {'nonlinear' if model.nonlinear else 'linear'}"


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the measurements."""
    measured = figures["outputs_mm"]
    spread = figures["uncertainty_mm"]
    reference = "; ".join(
        f"{-value:.3f} ± {each:.3f} mm" for value, each in zip(measured, spread, strict=True)
    )
    rows = []
    for name, row in figures["models"].items():
        nominal, matching = row["nominal"], row["matching"]
        rows.append(
            Claim(
                f"outputs: {title_of(name)}",
                reference,
                f"{-np.mean(nominal['outputs_mm']):.4f} mm",
                f"root mean square errors of the gradients {_errors(nominal)}; with E = "
                f"{row['young_MPa']:.3f} MPa {_errors(matching)}",
            )
        )
    return rows


def _errors(row: Mapping[str, Any]) -> str:
    """Return the errors of both data sets."""
    return " and ".join(f"{AREA * row[each.name]['rms']:.2f}e-9 m²" for each in gradients())


STUDY = register(
    Study(
        name="measured",
        title="A printed triangular lattice, measured by others",
        after="not part of the paper",
        page="measured",
        full=Settings(),
        quick=Settings(
            models=("bars", "springs", "frame-free-linear", "frame-clamped-nonlinear"),
            effects=("base", "free", "joint", "width"),
            samples=20,
        ),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda figures: (
            f"{count(len(figures['models']), 'model')}, {count(figures['samples'], 'lattice')} "
            "with random errors of each kind"
        ),
    )
)
