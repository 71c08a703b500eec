"""What networks learn: accuracy along the training, predictions, designs they make."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.plots import style
from reproduction import published
from reproduction.formatting import count, number, percent
from reproduction.longer import longer_jobs
from reproduction.pictures.charts import Chart, Density, Level, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.predicting import BINS, Settings, shipped, trained
from reproduction.registry import Claim, Figures, Study, register

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.result_store import ResultStore


def run(settings: Settings, store: ResultStore) -> Figures:
    """Make runs, predict them, and let the network search."""
    store.progress("network", 0, 1)
    found = store.compute("predicted", partial(trained if settings.train else shipped, settings))
    store.progress("network", 1, 1)
    return {
        "problem": settings.problem,
        "runs": settings.runs,
        "steps": settings.steps,
        "trained_here": settings.train,
        **found,
        "records": {} if settings.train else longer_jobs(),
    }


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw accuracy along the training, predictions, and what a search by the network makes."""
    charts = [_course(figures), _density(figures), _designs(figures)]
    small = "trained here" if figures["trained_here"] else "that comes along"
    sheet = Sheet(
        title=f"{figures['problem']}: what a network learns",
        note=f"{figures['network']} {small}, {figures['looks']:,.0f} looks; tested on "
        f"{count(figures['accuracy']['count'], 'design')} of runs that it has not seen",
        charts=charts,
        height=3.0,
    )
    draw_sheet(sheet, path, overwrite=True)


def _course(figures: Mapping[str, Any]) -> Chart:
    series = []
    rows = [(figures["network"], figures["epochs"], style.BEST)]
    if "resnet50" in figures["records"]:
        rows.append(("resnet50", figures["records"]["resnet50"]["epochs"], style.BUILT))
    for name, epochs, colour in rows:
        across = np.array([each["designs"] for each in epochs], dtype=float)
        up = np.array([each["r_squared"] or np.nan for each in epochs], dtype=float)
        series.append(Series(across, up, name=name, kind="both", colour=colour))
    level = Level(published.R_SQUARED, f"the paper, {published.R_SQUARED}")
    return Chart(
        "R² along the training", "designs seen", "R² on held-out runs", series, [level],
        log_x=True, limits_y=(0.0, 1.02), legend="lower right",
    )  # fmt: skip


def _density(figures: Mapping[str, Any]) -> Chart:
    low, high = figures["ends"]
    slope, offset = figures["fit"]
    ends = np.array([low, high])
    told = figures["accuracy"]
    return Chart(
        "Predicted against actual",
        "efficiency by mechanics",
        "efficiency predicted",
        [
            Series(ends, ends, name="equal", colour=style.IDLE, width=1.0, level=2.5),
            Series(ends, slope * ends + offset, name=f"fit, slope {slope:.2f}",
                   colour=style.INPUT, width=1.3),
        ],
        density=Density(np.array(figures["grid"], dtype=float), low, high),
        limits_x=(low, high), limits_y=(low, high), legend="lower right",
        note=[f"R² {told['r_squared']:.3f}", f"determination {told['determination']:.3f}"],
    )  # fmt: skip


def _designs(figures: Mapping[str, Any]) -> Chart:
    """Draw designs made by the network, or where there are none the spread of predictions."""
    groups = [("mechanics", style.INPUT), ("network", style.BEST)]
    made = figures["records"].get("driven")
    if made is None:
        ends = np.linspace(figures["ends"][0], figures["ends"][1], BINS + 1)
        total = sum(figures["spread"]["mechanics"])
        spread = [
            Series(ends[:-1], 100.0 / total * np.array(figures["spread"][name]), kind="steps",
                   name=f"by {name}", colour=colour)
            for name, colour in groups
        ]  # fmt: skip
        return Chart("The same designs", "efficiency", "designs, %", spread, legend="upper left")
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
        f"Designs made in {made['chains']} chains", "true efficiency", "designs, %", series,
        legend="upper left",
    )  # fmt: skip


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    told, records = figures["accuracy"], figures["records"]
    what = "trained here" if figures["trained_here"] else "that comes along"
    found = [
        Claim(
            "a network predicts efficiencies from pictures: R² on designs held out",
            f"{published.R_SQUARED} (ResNet50, {published.PICTURES:,} pictures)",
            f"{number(told['r_squared'], 3)} ({figures['network']} {what}, "
            f"{count(told['count'], 'design')} of runs that it has not seen); "
            f"determination {number(told['determination'], 3)}",
        ),
    ]
    for name, claimed in (("resnet50", _by_recipe), ("driven", _made), ("costs", _speed)):
        if name in records:
            found += claimed(records[name])
    return found


def _by_recipe(row: Mapping[str, Any]) -> list[Claim]:
    """Say what the paper's own network and recipe came to."""
    return [
        Claim(
            "the same by the paper's own recipe",
            f"{published.R_SQUARED}",
            f"{number(row['r_squared'], 3)} after {row['looks']:,} looks at "
            f"{row['designs']:,} designs",
            "10 epochs would be 8.7 million looks: no GPU was at hand",
        )
    ]


def _made(row: Mapping[str, Any]) -> list[Claim]:
    """Say what designs a network makes."""
    return [
        Claim(
            "efficiency of designs that the network makes, and that simulation makes",
            "",
            f"medians {number(row['median_network'])} by the network, "
            f"{number(row['median_mechanics'])} by mechanics; "
            f"{count(row['chains'], 'chain')} each, efficiencies by mechanics",
        ),
        Claim(
            "beams that tell a design made by the network from the nearest it has learnt from",
            f"about {published.BEAMS_APART}",
            f"{number(row['distance'], 0)} in the median",
        ),
    ]


def _speed(row: Mapping[str, Any]) -> list[Claim]:
    """Say how fast the network is beside two ways to simulate."""
    return [
        Claim(
            "how many times faster the network is than simulation",
            f"about {published.SPEED_UP}",
            f"{row['fire'] / row['resnet18']:.0f} against first-order relaxation, "
            f"{row['newton'] / row['resnet18']:.2f} against Newton's method",
            "one core each; the smaller network that comes along, in batches",
        )
    ]


def runs(figures: Mapping[str, Any]) -> str:
    """Say how much was computed."""
    return (
        f"{count(figures['runs'], 'run')} of {count(figures['steps'], 'proposal')}, "
        f"{percent(1.0) if not figures['trained_here'] else percent(0.25)} of them for the test"
    )


STUDY = register(
    Study(
        name="learning",
        title="What a network learns, and the designs it makes",
        after="figure 6",
        full=Settings(),
        quick=Settings(runs=32, steps=250, epochs=8, train=True),
        run=run,
        draw=draw,
        claims=claims,
        runs=runs,
        deviations=(
            (
                "The network that comes along is smaller than the paper's ResNet50; a training of "
                "that by the paper's recipe went 0.3 % of its way (`docs/surrogate/resnet50.json`)."
            ),
            (
                "Designs made by networks, distances and costs are those of "
                "`docs/surrogate/driven.json` and `costs.json`, where a checkout has them."
            ),
        ),
    )
)
