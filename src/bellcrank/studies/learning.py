"""What networks learn: accuracy along the training, predictions, designs they make."""

from __future__ import annotations

import json
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.learning.building import reverse
from bellcrank.mechanics import Status
from bellcrank.model import find_problem
from bellcrank.plots import style
from bellcrank.plots.charts import Chart, Density, Level, Series
from bellcrank.plots.sheets import Sheet, draw_sheet
from bellcrank.search import chain_blocks, make_responder, read_settings
from bellcrank.studies import published
from bellcrank.studies.registry import Claim, Figures, Study, register
from bellcrank.studies.words import count, number, share
from bellcrank.surrogate.backend import import_torch

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from bellcrank.studies.bench import Bench
    from bellcrank.surrogate.dataset import Dataset

RECORDS = Path(__file__).parents[3] / "docs" / "surrogate"
"""Of longer trainings and searches, in a checkout; a wheel has none."""
BINS = 64
FIRST = 3_000_000
"""Seed of the runs that the network which comes along is tested with: it has learnt from others."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """A network, and what it is tested with.

    Parameters
    ----------
    runs, steps
        Searches whose proposals are predicted, half of them backwards.
    train
        Whether a small network is trained on them first, and tested on a quarter of the runs;
        else the one that comes along predicts all of them.
    model, epochs
        Of that training.
    """

    problem: str = "crane"
    runs: int = 24
    steps: int = 582
    train: bool = False
    model: str = "mlp"
    epochs: int = 12


def run(settings: Settings, bench: Bench) -> Figures:
    """Make runs, predict them, and let the network search."""
    bench.tell("network", 0, 1)
    found = bench.one("predicted", partial(_trained if settings.train else _shipped, settings))
    bench.tell("network", 1, 1)
    return {
        "problem": settings.problem,
        "runs": settings.runs,
        "steps": settings.steps,
        "trained_here": settings.train,
        **found,
        "records": {} if settings.train else _records(),
    }


def dataset(settings: Settings) -> Dataset:
    """Return all that searches there and back proposed."""
    from bellcrank.surrogate.dataset import Dataset

    problem = find_problem(settings.problem)
    packed, efficiency, run_of = [], [], []
    for number_of in range(settings.runs):
        sign = -1.0 if number_of % 2 else 1.0
        searched = problem if sign > 0.0 else reverse(problem)
        told = {"search": "paper", "steps": settings.steps, "seed": FIRST + number_of}
        search = read_settings({**told, "chains": 1})
        for _, rows in chain_blocks(make_responder(searched, search), search, 0):
            sound = rows.status == Status.CONVERGED
            packed.append(rows.mask[sound])
            efficiency.append(sign * rows.efficiency[sound])
            run_of.append(np.full(int(sound.sum()), number_of))
    return Dataset(problem, np.vstack(packed), np.concatenate(efficiency), np.concatenate(run_of))


def _shipped(settings: Settings) -> dict[str, Any]:
    """Predict with the network that comes along."""
    from bellcrank.surrogate.predictor import load_models

    data = dataset(settings)
    model: Any = load_models(data.problem)[0]
    told = _tested(model.predict(data.packed), data.efficiency)
    epochs = [
        {"designs": each["designs"], "r_squared": each["r_squared"]}
        for each in model.record["epochs"]
    ]
    before = model.record.get("before", {}).get("designs", 0)
    return {
        "network": model.architecture,
        "looks": model.seen["designs"],
        "epochs": [{**each, "designs": each["designs"] + before} for each in epochs],
        "held_out_by_its_record": model.record["held_out"],
        **told,
    }


def _trained(settings: Settings) -> dict[str, Any]:
    """Train a small network on most of the runs, and predict the others."""
    from bellcrank.surrogate.beginning import begin
    from bellcrank.surrogate.recipes import recipe_of

    data = dataset(settings)
    recipe = recipe_of("own", model=settings.model, epochs=settings.epochs, precision="float32")
    with one_thread():
        training = begin(data, recipe, device="cpu")
        for _ in training.run():
            pass
        model = training.finish()
    held_out = training.split.held_out
    told = _tested(model.predict(data.packed[held_out]), data.efficiency[held_out])
    epochs = [
        {"designs": each["designs"], "r_squared": each["r_squared"]}
        for each in model.record["epochs"]
    ]
    return {"network": model.architecture, "looks": model.seen["designs"], "epochs": epochs, **told}


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep small networks from waiting for threads."""
    torch = import_torch()
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _tested(predicted: np.ndarray, actual: np.ndarray) -> dict[str, Any]:
    """Return how predictions agree, as figures and as counts on a grid."""
    from bellcrank.surrogate.metrics import accuracy

    low = float(min(predicted.min(), actual.min()))
    high = float(max(predicted.max(), actual.max()))
    room = 0.02 * (high - low)
    ends = (low - room, high + room)
    grid, _, _ = np.histogram2d(predicted, actual, bins=BINS, range=(ends, ends))
    slope, offset = np.polyfit(actual, predicted, 1)
    both = [np.histogram(values, bins=BINS, range=ends)[0] for values in (actual, predicted)]
    return {
        "accuracy": accuracy(predicted, actual).to_dict(),
        "fit": [float(slope), float(offset)],
        "ends": ends,
        "grid": grid.astype(int).tolist(),
        "spread": {"mechanics": both[0].tolist(), "network": both[1].tolist()},
    }


def _records() -> dict[str, Any]:
    """Return what the records of longer jobs say, where there are any."""
    found: dict[str, Any] = {}
    for name, read in (("resnet50", _resnet50), ("driven", _driven), ("costs", _costs)):
        path = RECORDS / f"{name}.json"
        if path.is_file():
            told = json.loads(path.read_text(encoding="utf-8"))
            found[name] = {**read(told), "commit": told["provenance"]["commit"]}
    return found


def _resnet50(told: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "designs": told["data"]["designs"],
        "looks": told["designs"],
        "r_squared": told["held_out"]["r_squared"],
        "epochs": [
            {"designs": each["designs"], "r_squared": each["r_squared"]} for each in told["epochs"]
        ],
    }


def _driven(told: Mapping[str, Any]) -> dict[str, Any]:
    final = [each for each in told["by_network"] if each["offer"] == "final"]
    mechanics = [each for each in told["by_mechanics"] if each["offer"] == "final"]
    return {
        "chains": told["settings"]["chains"],
        "distance": told["medians"]["final"]["distance"],
        "distances": [each["distance"] for each in final],
        "median_network": told["medians"]["final"]["network"],
        "median_mechanics": told["medians"]["final"]["mechanics"],
        "mechanics": [each["efficiency"] for each in mechanics],
        "network": [each["efficiency"] for each in final],
    }


def _costs(told: Mapping[str, Any]) -> dict[str, Any]:
    rows = {(row["what"], row["where"], row["batch"]): row["microseconds"] for row in told["costs"]}
    core = "one core"
    return {
        "fire": rows["`fire` response", core, 1],
        "newton": rows["Newton response (default)", core, 1],
        "resnet18": min(
            value for (what, where, _), value in rows.items()
            if where == core and what.startswith("resnet18-w16")
        ),
        "resnet50": min(
            (value for (what, where, _), value in rows.items()
             if where == core and what.startswith("resnet50")), default=None
        ),
    }  # fmt: skip


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
        ends = np.linspace(*figures["ends"], BINS + 1)
        total = sum(figures["spread"]["mechanics"])
        spread = [
            Series(ends[:-1], 100.0 / total * np.array(figures["spread"][name]), kind="steps",
                   name=f"by {name}", colour=colour)
            for name, colour in groups
        ]  # fmt: skip
        return Chart("The same designs", "efficiency", "designs, %", spread, legend="upper right")
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
    if "resnet50" in records:
        row = records["resnet50"]
        found.append(
            Claim(
                "the same by the paper's own recipe",
                f"{published.R_SQUARED}",
                f"{number(row['r_squared'], 3)} after {row['looks']:,} looks at "
                f"{row['designs']:,} designs",
                "10 epochs would be 8.7 million looks: no GPU was at hand",
            )
        )
    if "driven" in records:
        made = records["driven"]
        found += [
            Claim(
                "designs made by the network are as efficient as those made by simulation",
                "similar distributions",
                f"medians {number(made['median_network'])} by the network, "
                f"{number(made['median_mechanics'])} by mechanics; "
                f"{count(made['chains'], 'chain')} each, efficiencies by mechanics",
            ),
            Claim(
                "beams that tell a design made by the network from the nearest it has learnt from",
                f"about {published.BEAMS_APART}",
                f"{number(made['distance'], 0)} in the median",
            ),
        ]
    if "costs" in records:
        costs = records["costs"]
        found.append(
            Claim(
                "how many times faster the network is than simulation",
                f"about {published.SPEED_UP}",
                f"{costs['fire'] / costs['resnet18']:.0f} against first-order relaxation, "
                f"{costs['newton'] / costs['resnet18']:.2f} against Newton's method",
                "one core each; the smaller network that comes along, in batches",
            )
        )
    return found


def runs(figures: Mapping[str, Any]) -> str:
    """Say how much was computed."""
    return (
        f"{count(figures['runs'], 'run')} of {count(figures['steps'], 'proposal')}, "
        f"{share(1.0) if not figures['trained_here'] else share(0.25)} of them for the test"
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
