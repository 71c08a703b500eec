"""Result folder of a search with a network: record, best design, picture."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.model import write_design
from bellcrank.model.storage import write_text
from bellcrank.plots import style
from bellcrank.storage import require_new_folder
from bellcrank.storage.files import make_folder
from reproduction.networks.surrogate_search import OFFERS, best_design
from reproduction.pictures.charts import Chart, Level, Series
from reproduction.pictures.sheets import Sheet, draw_sheet

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.model import Problem

RECORD = "surrogate-search.json"
DESIGN = "design.json"
PICTURE = "surrogate-search.png"
BINS = 10
DRAWN = "verified"
"""Rule of the designs in the picture."""


def write_surrogate_search(record: dict[str, Any], problem: Problem, folder: Path) -> None:
    """Write the record, the best design and a picture.

    Parameters
    ----------
    folder
        New or empty.

    Raises
    ------
    OutputExists
        If the folder is not empty.
    StorageError
        If it cannot be written.
    """
    require_new_folder(folder)
    make_folder(folder)
    write_text(folder / RECORD, json.dumps(record, indent=1) + "\n")
    if (design := best_design(problem, record)) is not None:
        write_design(design, folder / DESIGN)
    draw_sheet(sheet_of(record), folder / PICTURE)


def sheet_of(record: dict[str, Any]) -> Sheet:
    """Return charts of efficiencies, predictions and distances (figures 6 b, c of the paper)."""
    designs = [design for design in record["by_network"] if design["offer"] == DRAWN]
    stable = [design for design in designs if design["efficiency"] is not None]
    charts = [_efficiencies(record), _predictions(stable, len(designs) - len(stable))]
    distances = np.array([design["distance"] for design in designs], np.float64)
    if np.isfinite(distances).all():
        middle = float(np.median(distances))
        charts.append(
            Chart(
                "Distance to the dataset",
                "beams that differ from the nearest design",
                "designs, %",
                [Series(_edges(distances), distances, kind="histogram", colour=style.BUILT)],
                [Level(middle, f"median {middle:.0f}", vertical=True)],
                legend="upper left",
            )
        )
    return Sheet(
        title=f"{record['problem']}: search with {record['architecture']}",
        note=f"{len(designs)} chains of {record['settings']['steps']} steps; {OFFERS[DRAWN]}",
        charts=charts,
        height=3.0,
    )


def _efficiencies(record: dict[str, Any]) -> Chart:
    values = {
        name: np.array(
            [
                design["efficiency"]
                for design in record[f"by_{name}"]
                if design["offer"] == DRAWN and design["efficiency"] is not None
            ]
        )
        for name in ("mechanics", "network")
    }
    edges = _edges(np.concatenate(list(values.values())))
    series = [
        Series(
            edges, values[name], kind="histogram", colour=colour,
            name=f"with {name}, median {np.median(values[name]):.2f}",
        )
        for name, colour in (("mechanics", style.INPUT), ("network", style.BEST))
        if len(values[name])
    ]  # fmt: skip
    return Chart("Efficiency", "efficiency by mechanics", "designs, %", series, legend="upper left")


def _predictions(stable: list[dict[str, Any]], failed: int) -> Chart:
    actual = np.array([design["efficiency"] for design in stable], np.float64)
    predicted = np.array([design["predicted"] for design in stable], np.float64)
    both = np.concatenate([actual, predicted]) if stable else np.array([0.0, 1.0])
    ends = np.array([both.min(), both.max()])
    return Chart(
        "Predicted against actual",
        "efficiency by mechanics",
        "efficiency predicted",
        [
            Series(ends, ends, name="equal", colour=style.IDLE, width=1.0, level=2.5),
            Series(actual, predicted, kind="points", colour=style.BEST),
        ],
        legend="lower right",
        note=[f"{failed} without a unique response"] if failed else [],
    )


def _edges(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the edges of the bins of a histogram."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    return np.linspace(low, high if high > low else low + 1.0, BINS + 1)
