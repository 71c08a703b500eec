"""Accuracy of networks during training, their predictions, and designs found with them."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.plots import style
from reproduction import published
from reproduction.formatting import count, number, percent
from reproduction.pictures.charts import Chart, Density, Level, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.predictions import Settings, bundled, trained
from reproduction.registry import Claim, Figures, Study, register

if TYPE_CHECKING:
    from collections.abc import Mapping

    from reproduction.result_store import ResultStore


RECORDS = Path(__file__).parents[1] / "docs" / "surrogate"
"""Records of longer trainings and searches."""


def run(settings: Settings, store: ResultStore) -> Figures:
    """Run searches, and predict their designs by a network."""
    store.progress("network", 0, 1)
    found = store.compute("predicted", partial(trained if settings.train else bundled, settings))
    store.progress("network", 1, 1)
    return {
        "problem": settings.problem,
        "runs": settings.runs,
        "steps": settings.steps,
        "trained_here": settings.train,
        **found,
        "records": {} if settings.train else _training_records(),
    }


def _training_records() -> dict[str, Any]:
    """Return the results of longer trainings and searches from their records."""
    found: dict[str, Any] = {}
    for name, read in (("surrogate-search", _search), ("costs", _costs)):
        path = RECORDS / f"{name}.json"
        if path.is_file():
            record = json.loads(path.read_text(encoding="utf-8"))
            found[name] = {**read(record), "commit": record["provenance"]["commit"]}
    return found


def _search(record: Mapping[str, Any]) -> dict[str, Any]:
    medians = record["medians"]["final"]
    rows = {
        by: [each for each in record[f"by_{by}"] if each["offer"] == "final"]
        for by in ("network", "mechanics")
    }
    return {
        "chains": record["settings"]["chains"],
        "distance": medians["distance"],
        "distances": [each["distance"] for each in rows["network"]],
        "median_network": medians["network"],
        "median_mechanics": medians["mechanics"],
        **{by: [each["efficiency"] for each in rows[by]] for by in rows},
    }


def _costs(record: Mapping[str, Any]) -> dict[str, Any]:
    rows = [row for row in record["costs"] if row["device"] == "one core"]
    single = {row["method"]: row["microseconds"] for row in rows if row["batch"] == 1}
    return {
        "newton": single["Newton response (default)"],
        "resnet18": min(
            row["microseconds"] for row in rows if row["method"].startswith("resnet18-w16")
        ),
    }


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw accuracy during training, predictions, and designs of searches with the network."""
    charts = [_training_chart(figures), _density_chart(figures)]
    if "surrogate-search" in figures["records"]:
        charts.append(_designs_chart(figures["records"]["surrogate-search"]))
    sheet = Sheet(
        title=f"{figures['problem']}: accuracy of a network and designs found with it",
        note=f"{_network(figures)}, {figures['looks']:,.0f} training samples; tested on "
        f"{count(figures['accuracy']['count'], 'design')} of unseen runs",
        charts=charts,
        height=3.0,
    )
    draw_sheet(sheet, path, overwrite=True)


def _training_chart(figures: Mapping[str, Any]) -> Chart:
    samples = np.array([each["designs"] for each in figures["epochs"]], dtype=float)
    accuracy = np.array([each["r_squared"] or np.nan for each in figures["epochs"]], dtype=float)
    series = [Series(samples, accuracy, name=figures["network"], kind="both", colour=style.BEST)]
    level = Level(published.R_SQUARED, f"the paper, {published.R_SQUARED}")
    return Chart(
        "Accuracy during training", "training samples", "R² on held-out runs", series, [level],
        log_x=True, limits_y=(0.0, 1.02), legend="lower right",
    )  # fmt: skip


def _density_chart(figures: Mapping[str, Any]) -> Chart:
    low, high = figures["ends"]
    slope, offset = figures["fit"]
    ends = np.array([low, high])
    accuracy = figures["accuracy"]
    return Chart(
        "Predicted and simulated efficiency",
        "simulated efficiency",
        "predicted efficiency",
        [
            Series(ends, ends, name="equal", colour=style.IDLE, width=1.0, level=2.5),
            Series(ends, slope * ends + offset, name=f"fit, slope {slope:.2f}",
                   colour=style.INPUT, width=1.3),
        ],
        density=Density(np.array(figures["grid"], dtype=float), low, high),
        limits_x=(low, high), limits_y=(low, high), legend="lower right",
        note=[
            f"R² {accuracy['r_squared']:.3f}", f"determination {accuracy['determination']:.3f}"
        ],
    )  # fmt: skip


def _designs_chart(made: Mapping[str, Any]) -> Chart:
    """Chart the designs found with the network and with the mechanics."""
    groups = [("mechanics", style.INPUT), ("network", style.BEST)]
    known = {
        name: np.array([value for value in made[name] if value is not None]) for name, _ in groups
    }
    both = np.concatenate(list(known.values()))
    edges = np.linspace(float(both.min()), float(both.max()) + 1e-9, 15)
    series = [
        Series(
            edges, known[name], kind="histogram", colour=colour,
            name=f"by {name}, median {np.median(known[name]):.2f}",
        )
        for name, colour in groups
    ]  # fmt: skip
    return Chart(
        f"Designs of {made['chains']} chains", "simulated efficiency", "designs, %", series,
        legend="upper left",
    )  # fmt: skip


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    accuracy, records = figures["accuracy"], figures["records"]
    found = [
        Claim(
            "R² of predicted efficiencies on held-out designs",
            f"{published.R_SQUARED} (ResNet50, {published.PICTURES:,} pictures)",
            f"{number(accuracy['r_squared'], 3)} ({_network(figures)}, "
            f"{count(accuracy['count'], 'design')} of unseen runs); coefficient of determination "
            f"{number(accuracy['determination'], 3)}",
        ),
    ]
    for name, rows in (("surrogate-search", _design_claims), ("costs", _speed)):
        if name in records:
            found += rows(records[name])
    return found


def _network(figures: Mapping[str, Any]) -> str:
    """Return the name and the origin of the network."""
    return f"{figures['network']}, {'trained here' if figures['trained_here'] else 'bundled'}"


def _design_claims(row: Mapping[str, Any]) -> list[Claim]:
    """Compare the designs of searches with the network and with the mechanics."""
    return [
        Claim(
            "efficiency of designs found with the network and with the mechanics",
            "",
            f"medians {number(row['median_network'])} and {number(row['median_mechanics'])}, "
            f"{count(row['chains'], 'chain')} each; simulated efficiencies",
        ),
        Claim(
            "differing beams between a design by the network and the nearest training design",
            f"about {published.BEAMS_APART}",
            f"median {number(row['distance'], 0)}",
        ),
    ]


def _speed(row: Mapping[str, Any]) -> list[Claim]:
    """Compare the speed of the network with that of the simulation."""
    return [
        Claim(
            "ratio of the times of a simulation and of a prediction",
            f"about {published.SPEED_UP}",
            number(row["newton"] / row["resnet18"]),
            "one core; bundled network, in batches; Newton's method, where the paper minimises the "
            "energy by a first-order method",
        )
    ]


def runs(figures: Mapping[str, Any]) -> str:
    """Return the computed amount as text."""
    return (
        f"{count(figures['runs'], 'run')} of {count(figures['steps'], 'proposal')}, "
        f"{percent(0.25 if figures['trained_here'] else 1.0)} of them for the test"
    )


STUDY = register(
    Study(
        name="learning",
        title="Accuracy of a network, and designs found with it",
        after="figure 6",
        full=Settings(),
        quick=Settings(runs=32, steps=250, epochs=8, train=True),
        run=run,
        draw=draw,
        claims=claims,
        runs=runs,
        deviations=(
            (
                "The bundled network is smaller than the paper's ResNet50, whose training needs a "
                "GPU and was not repeated."
            ),
            (
                "Designs found with the network, distances and times are taken from "
                "`docs/surrogate/surrogate-search.json` and `docs/surrogate/costs.json`."
            ),
        ),
    )
)
