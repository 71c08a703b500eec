"""What learned surrogates cost beside the mechanics: ``python -m benchmarks.surrogate [--quick]``.

Everything is measured in one run. On one core it is processor time of one thread, so that what
else the machine does hardly matters; on a GPU it is wall time. A candidate is a packed mask, so
that figures of networks include making what they look at. Prints Markdown and writes
``docs/surrogate/costs.json``.
"""

from __future__ import annotations

import argparse
import io
import json
import platform
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem
from bellcrank.provenance import provenance
from bellcrank.surrogate.backend import find_precision
from bellcrank.surrogate.dataset import Dataset
from bellcrank.surrogate.models import models
from bellcrank.surrogate.recipes import Recipe
from bellcrank.surrogate.trained_model import TrainedModel, architecture_of
from bellcrank.surrogate.training_setup import begin
from bellcrank.surrogate.views import PictureView, View, views
from benchmarks.chains import record

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.surrogate.pictures import Canvas

PROBLEM = "crane"
OUT = Path(__file__).parents[1] / "docs" / "surrogate" / "costs.json"
GPU_BATCHES = (1, 256, 4096)


@dataclass(frozen=True, slots=True)
class Effort:
    """How much of everything to measure."""

    steps: int
    pictures: int
    saved: int
    responses: int
    batches: tuple[int, ...]
    seconds: float
    training_steps: int


FULL = Effort(4000, 20_000, 200, 40, (1, 256), 5.0, 12)
QUICK = Effort(1000, 2000, 10, 4, (1, 32), 0.3, 2)


@dataclass(frozen=True, slots=True)
class Cost:
    """What one candidate costs, by one way of judging it."""

    what: str
    where: str
    batch: int
    microseconds: float


def seconds_of(
    work: Callable[[], object], least: float, clock: Callable[[], float] = time.process_time
) -> float:
    """Mean seconds of a call, over so many seconds of calls, after one to warm up."""
    work()
    count, start = 0, clock()
    while not count or clock() - start < least:
        work()
        count += 1
    return (clock() - start) / count


def designs(effort: Effort) -> NDArray[np.bool_]:
    """Return what a chain proposes, without its beginning."""
    return record(PROBLEM, effort.steps).masks[effort.steps // 4 :]


def save_as_matplotlib(lines: NDArray[np.float64], canvas: Canvas) -> bytes:
    """Make one picture as scripts do: a figure, its lines, savefig."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    figure = Figure(figsize=(canvas.width / 72, canvas.height / 72), dpi=72, frameon=False)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set(xlim=(0, canvas.width), ylim=(0, canvas.height))
    axes.add_collection(LineCollection(lines, colors="black", linewidths=canvas.line))
    buffer = io.BytesIO()
    figure.savefig(buffer)
    return buffer.getvalue()


def measure_rendering(masks: NDArray[np.bool_], effort: Effort) -> dict[str, float]:
    """Time pictures on the fly, and by savefig."""
    problem = find_problem(PROBLEM)
    view = PictureView(problem)
    rows = np.resize(np.arange(len(masks)), effort.pictures)
    packed = np.packbits(masks, axis=1)[rows]

    def render() -> None:
        for first in range(0, len(packed), 512):
            view.renderer.render(packed[first : first + 512])

    ours = seconds_of(render, effort.seconds) / len(packed)
    canvas = view.renderer.canvas
    lines = canvas.pixels_of(problem.lattice.positions)[problem.lattice.beams]
    start = time.process_time()
    for mask in masks[: effort.saved]:
        save_as_matplotlib(lines[mask], canvas)
    theirs = (time.process_time() - start) / min(effort.saved, len(masks))
    return {"pictures_per_second": 1.0 / ours, "savefig_per_second": 1.0 / theirs,
            "ratio": theirs / ours}  # fmt: skip


class TimedView:
    """A view that measures the time of its calls."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.scale = view.scale
        self.seconds = 0.0

    def arrays(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Compute the arrays, and add the time."""
        start = time.process_time()
        found = self.view.arrays(packed)
        self.seconds += time.process_time() - start
        return found


def measure_waiting(masks: NDArray[np.bool_], name: str, effort: Effort) -> float:
    """Return the fraction of a training's steps that is spent on making its inputs."""
    some = masks[: 32 * effort.training_steps * 4]
    packed = np.packbits(some, axis=1)
    runs = np.arange(len(some)) // max(len(some) // 8, 1)
    data = Dataset(find_problem(PROBLEM), packed, some.sum(axis=1).astype(float), runs)
    steps = effort.training_steps if name.startswith("resnet") else 20 * effort.training_steps
    recipe = Recipe(model=name, epochs=1, epoch_size=32 * (steps + 1), tested=2)
    training = begin(data, recipe, device="cpu")
    timed = TimedView(training.model.view)
    training.model = replace(training.model, view=timed)
    story = training._steps_of_epoch()  # noqa: SLF001
    next(story)
    timed.seconds, start = 0.0, time.process_time()
    for _ in range(steps - 1):
        next(story)
    return timed.seconds / (time.process_time() - start)


def measure_mechanics(masks: NDArray[np.bool_], effort: Effort) -> list[Cost]:
    """Time responses and the screening of all flips."""
    rows = np.linspace(0, len(masks) - 1, effort.responses).astype(int)
    costs = []
    evaluator = SpringEvaluator(find_problem(PROBLEM))
    evaluator.evaluate(masks[rows[0]])
    start = time.process_time()
    for row in rows:
        evaluator.evaluate(masks[row])
    seconds = (time.process_time() - start) / len(rows)
    costs.append(Cost("Newton response (default)", "one core", 1, 1e6 * seconds))
    seconds, flips = 0.0, 0
    evaluator.predict_flips(masks[rows[0]])
    for row in rows:
        start = time.process_time()
        screening = evaluator.predict_flips(masks[row])
        if screening is not None:
            seconds += time.process_time() - start
            flips += len(screening.beams)
    costs.append(Cost("low-rank screening, per flip", "one core", 1, 1e6 * seconds / flips))
    return costs


def network(name: str) -> TrainedModel:
    """Return a network as it comes: weights do not change what it costs."""
    problem = find_problem(PROBLEM)
    architecture = architecture_of(name)
    view = views[architecture.view](problem)
    built = architecture.build(view.shape).to(memory_format=torch.channels_last).eval()
    return TrainedModel(
        architecture=name, problem=problem, view=view, mean=0.0, deviation=1.0, network=built
    )


def measure_network(masks: NDArray[np.bool_], name: str, effort: Effort) -> list[Cost]:
    """Time predictions in each precision, on the processor and on a GPU."""
    model = network(name)
    packed = np.packbits(masks, axis=1)
    costs = []
    kinds = {"float32", find_precision("auto", torch.device("cpu"))}

    def add(what: str, where: str, batch: int, predict: Callable[..., object]) -> None:
        chosen = packed[np.arange(batch) % len(packed)]
        clock = time.process_time if where == "one core" else time.perf_counter
        seconds = seconds_of(lambda: predict(chosen), effort.seconds, clock) / batch
        costs.append(Cost(what, where, batch, 1e6 * seconds))

    for batch in effort.batches:
        for kind in sorted(kinds, reverse=True):
            add(f"{name}, torch {kind}", "one core", batch,
                lambda p, k=kind: model.predict(p, device="cpu", precision=k))  # fmt: skip
    if torch.cuda.is_available():
        for batch in GPU_BATCHES:
            for kind in ("float32", "bfloat16"):
                add(f"{name}, torch {kind}", torch.cuda.get_device_name(), batch,
                    lambda p, k=kind: model.predict(p, device="cuda", precision=k))  # fmt: skip
    return costs


def print_costs(costs: list[Cost]) -> None:
    """Print one row for each way, with its speed-ups."""
    newton = costs[0].microseconds
    print("\n| a candidate by | on | batch | us | faster than Newton |")
    print("|---|---|---|---|---|")
    for cost in costs:
        print(
            f"| {cost.what} | {cost.where} | {cost.batch} | {cost.microseconds:.4g} "
            f"| {newton / cost.microseconds:.3g} |"
        )
    if not torch.cuda.is_available():
        print("\nno GPU here")


def processor() -> str:
    """Return what the processor calls itself."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if "model name" in line), "")


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a rough look; writes only to --out")
    parser.add_argument("--out", type=Path, help=f"JSON; default: {OUT}")
    parser.add_argument("--models", nargs="+", choices=list(models), default=list(models))
    given = parser.parse_args()
    effort = QUICK if given.quick else FULL
    torch.set_num_threads(1)
    masks = designs(effort)
    rendering = measure_rendering(masks, effort)
    print(
        f"{rendering['pictures_per_second']:.0f} pictures a second on one core; savefig makes "
        f"{rendering['savefig_per_second']:.0f}: {rendering['ratio']:.0f} times as many\n"
    )
    print("| training | waits for data |\n|---|---|")
    waiting = {}
    for name in given.models:
        waiting[name] = measure_waiting(masks, name, effort)
        print(f"| {name} | {100.0 * waiting[name]:.2f} % |")
    costs = measure_mechanics(masks, effort)
    for name in given.models:
        costs += measure_network(masks, name, effort)
    print_costs(costs)
    out = given.out or (None if given.quick else OUT)
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        told = {
            "problem": PROBLEM, "processor": processor(), "gpu": torch.cuda.is_available(),
            "rendering": rendering, "waiting": waiting, "costs": [asdict(each) for each in costs],
            "provenance": provenance(torch=torch.__version__),
        }  # fmt: skip
        out.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
