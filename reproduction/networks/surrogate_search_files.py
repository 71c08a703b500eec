"""Result folder of a search with a network: record, best design, picture."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model import write_design
from bellcrank.model.storage import write_text
from bellcrank.plots import style
from bellcrank.storage import require_new_folder
from bellcrank.storage.files import make_folder
from reproduction.networks.surrogate_search import OFFERS
from reproduction.pictures.charts import Chart, Level, Series
from reproduction.pictures.sheets import Sheet, draw_sheet

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from reproduction.networks.surrogate_search import OfferedDesign, SurrogateSearchResult

RECORD = "surrogate-search.json"
DESIGN = "design.json"
PICTURE = "surrogate-search.png"
DRAWN = "verified"
"""Offer in the picture."""
LEAST_BINS, MOST_BINS = 5, 16


def write_surrogate_search(result: SurrogateSearchResult, folder: Path) -> None:
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
    write_text(folder / RECORD, json.dumps(result.to_dict(), indent=1) + "\n")
    if (design := result.best_design()) is not None:
        write_design(design, folder / DESIGN)
    draw_sheet(sheet_of(result), folder / PICTURE)


def sheet_of(result: SurrogateSearchResult) -> Sheet:
    """Return charts of efficiencies, predictions and distances (figures 6 b, c of the paper)."""
    designs = result.offered(DRAWN)
    charts = [_efficiencies(result), _predictions(designs)]
    if all(design.distance is not None for design in designs):
        charts.append(_distances(designs))
    return Sheet(
        title=f"{result.problem.name}: search with {result.architecture}",
        note=f"{len(designs)} chains of {result.settings.steps} steps; {OFFERS[DRAWN]}",
        charts=charts,
        height=3.0,
    )


def _efficiencies(result: SurrogateSearchResult) -> Chart:
    groups = (
        ("mechanics", result.offered(DRAWN, by_network=False), style.INPUT),
        ("network", result.offered(DRAWN), style.BEST),
    )
    values = {name: _stable(designs) for name, designs, _ in groups}
    edges = edges_of(np.concatenate(list(values.values())))
    series = [
        Series(
            edges, values[name], kind="histogram", colour=colour,
            name=f"with {name}, median {np.median(values[name]):.2f}",
        )
        for name, _, colour in groups
        if len(values[name])
    ]  # fmt: skip
    return Chart("Efficiency", "efficiency by mechanics", "designs, %", series, legend="upper left")


def _predictions(designs: list[OfferedDesign]) -> Chart:
    stable = [design for design in designs if design.efficiency is not None]
    actual = _stable(stable)
    predicted = np.array([design.predicted for design in stable], np.float64)
    both = np.concatenate([actual, predicted]) if stable else np.array([0.0, 1.0])
    ends = np.array([both.min(), both.max()])
    failed = len(designs) - len(stable)
    note = [f"{failed} without a unique response"] if failed else []
    return Chart(
        "Predicted against actual",
        "efficiency by mechanics",
        "efficiency predicted",
        [
            Series(ends, ends, name="equal", colour=style.IDLE, width=1.0, level=2.5),
            Series(actual, predicted, kind="points", colour=style.BEST),
        ],
        legend="lower right",
        note=note,
    )


def _distances(designs: list[OfferedDesign]) -> Chart:
    distance = np.array([design.distance for design in designs], np.float64)
    middle = float(np.median(distance))
    return Chart(
        "Distance to the dataset",
        "beams that differ from the nearest design",
        "designs, %",
        [Series(edges_of(distance), distance, kind="histogram", colour=style.BUILT)],
        [Level(middle, f"median {middle:.0f}", vertical=True)],
        legend="upper left",
    )


def _stable(designs: list[OfferedDesign]) -> NDArray[np.float64]:
    """Return the efficiencies of the designs that have one."""
    return np.array(
        [design.efficiency for design in designs if design.efficiency is not None], np.float64
    )


def edges_of(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the edges of the bins of a histogram; their number grows with that of the values.

    Examples
    --------
    >>> edges_of(np.array([0.0, 1.0])).tolist()
    [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    """
    if not len(values):
        return np.linspace(0.0, 1.0, LEAST_BINS + 1).round(12)
    bins = int(np.clip(1.6 * np.sqrt(len(values)), LEAST_BINS, MOST_BINS))
    low, high = float(values.min()), float(values.max())
    return np.linspace(low, high if high > low else low + 1.0, bins + 1).round(12)
