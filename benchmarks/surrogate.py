"""Cost of surrogates and of the spring model: ``python -m benchmarks.surrogate [--quick]``.

All costs are measured in the same run: on one core as the processor time of one thread, on a GPU
as wall time. The input of all methods is a packed mask, so that the times of networks include the
preparation of their inputs. Markdown tables are printed, and the results are written to
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
from benchmarks.chains import record_chain

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.surrogate.pictures import Canvas

PROBLEM = "crane"
RECORD = Path(__file__).parents[1] / "docs" / "surrogate" / "costs.json"
GPU_BATCHES = (1, 256, 4096)


@dataclass(frozen=True, slots=True)
class Effort:
    """Sizes of the measurements.

    Parameters
    ----------
    steps
        Steps of the chain whose proposals are evaluated.
    pictures, saved
        Number of pictures drawn by the renderer, and with `savefig`.
    responses
        Number of responses.
    batches
        Batch sizes of networks on one core.
    seconds
        Least time of the repeated calls of a measurement.
    training_steps
        Number of training steps.
    """

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
    """Time per design of one method on one device."""

    method: str
    device: str
    batch: int
    microseconds: float


def seconds_of(
    function: Callable[[], object], least: float, clock: Callable[[], float] = time.process_time
) -> float:
    """Return the mean time of calls that take `least` seconds in total, after a first call."""
    function()
    count, start = 0, clock()
    while not count or clock() - start < least:
        function()
        count += 1
    return (clock() - start) / count


def designs(effort: Effort) -> NDArray[np.bool_]:
    """Return the proposals of a chain after the first quarter of its steps."""
    return record_chain(PROBLEM, effort.steps).masks[effort.steps // 4 :]


def save_as_matplotlib(lines: NDArray[np.float64], canvas: Canvas) -> bytes:
    """Draw one picture with a matplotlib figure and `savefig`."""
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
    """Measure the rate of pictures by the renderer of the package and by `savefig`."""
    problem = find_problem(PROBLEM)
    view = PictureView(problem)
    rows = np.resize(np.arange(len(masks)), effort.pictures)
    packed = np.packbits(masks, axis=1)[rows]

    def render() -> None:
        for first in range(0, len(packed), 512):
            view.renderer.render(packed[first : first + 512])

    rendered = seconds_of(render, effort.seconds) / len(packed)
    canvas = view.renderer.canvas
    lines = canvas.pixels_of(problem.lattice.positions)[problem.lattice.beams]
    start = time.process_time()
    for mask in masks[: effort.saved]:
        save_as_matplotlib(lines[mask], canvas)
    saved = (time.process_time() - start) / min(effort.saved, len(masks))
    return {"pictures_per_second": 1.0 / rendered, "savefig_per_second": 1.0 / saved,
            "ratio": saved / rendered}  # fmt: skip


class TimedView:
    """A view that measures the time of its calls."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.scale = view.scale
        self.seconds = 0.0

    def arrays(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the arrays of the view, and add the time of the call to `seconds`."""
        start = time.process_time()
        arrays = self.view.arrays(packed)
        self.seconds += time.process_time() - start
        return arrays


def measure_input_share(masks: NDArray[np.bool_], name: str, effort: Effort) -> float:
    """Return the fraction of the training time that is the preparation of the inputs."""
    selected = masks[: 32 * effort.training_steps * 4]
    packed = np.packbits(selected, axis=1)
    runs = np.arange(len(selected)) // max(len(selected) // 8, 1)
    data = Dataset(find_problem(PROBLEM), packed, selected.sum(axis=1).astype(float), runs)
    steps = effort.training_steps if name.startswith("resnet") else 20 * effort.training_steps
    recipe = Recipe(model=name, epochs=1, epoch_size=32 * (steps + 1), tested=2)
    training = begin(data, recipe, device="cpu")
    timed = TimedView(training.model.view)
    training.model = replace(training.model, view=timed)
    epoch = training._steps_of_epoch()  # noqa: SLF001
    next(epoch)
    timed.seconds, start = 0.0, time.process_time()
    for _ in range(steps - 1):
        next(epoch)
    return timed.seconds / (time.process_time() - start)


def measure_mechanics(masks: NDArray[np.bool_], effort: Effort) -> list[Cost]:
    """Measure the times of responses and of the prediction of all flips."""
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
        prediction = evaluator.predict_flips(masks[row])
        if prediction is not None:
            seconds += time.process_time() - start
            flips += len(prediction.beams)
    costs.append(Cost("low-rank update, per flip", "one core", 1, 1e6 * seconds / flips))
    return costs


def network(name: str) -> TrainedModel:
    """Return an untrained network; the time of a prediction does not depend on the weights."""
    problem = find_problem(PROBLEM)
    architecture = architecture_of(name)
    view = views[architecture.view](problem)
    module = architecture.build(view.shape).to(memory_format=torch.channels_last).eval()
    return TrainedModel(
        architecture=name, problem=problem, view=view, mean=0.0, deviation=1.0, network=module
    )


def measure_network(masks: NDArray[np.bool_], name: str, effort: Effort) -> list[Cost]:
    """Measure the times of predictions for each precision, on the processor and on a GPU."""
    model = network(name)
    packed = np.packbits(masks, axis=1)
    costs = []
    precisions = {"float32", find_precision("auto", torch.device("cpu"))}

    def add(precision: str, device: str, batch: int) -> None:
        inputs = packed[np.arange(batch) % len(packed)]
        where, clock = "one core", time.process_time
        if device == "cuda":
            where, clock = torch.cuda.get_device_name(), time.perf_counter
        seconds = seconds_of(
            lambda: model.predict(inputs, device=device, precision=precision),
            effort.seconds,
            clock,
        )
        costs.append(Cost(f"{name}, torch {precision}", where, batch, 1e6 * seconds / batch))

    for batch in effort.batches:
        for precision in sorted(precisions, reverse=True):
            add(precision, "cpu", batch)
    if torch.cuda.is_available():
        for batch in GPU_BATCHES:
            for precision in ("float32", "bfloat16"):
                add(precision, "cuda", batch)
    return costs


def print_costs(costs: list[Cost]) -> None:
    """Print one row for each method, with the ratio of its time to that of Newton's method."""
    newton = costs[0].microseconds
    print("\n| method | device | batch | us per design | times as fast as Newton |")
    print("|---|---|---|---|---|")
    for cost in costs:
        print(
            f"| {cost.method} | {cost.device} | {cost.batch} | {cost.microseconds:.4g} "
            f"| {newton / cost.microseconds:.3g} |"
        )
    if not torch.cuda.is_available():
        print("\nNo GPU was found.")


def processor() -> str:
    """Return the name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if "model name" in line), "")


def main() -> None:
    """Measure, print the tables and write the record."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="short measurements; no file without --out"
    )
    parser.add_argument("--out", type=Path, help=f"JSON file; default: {RECORD}")
    parser.add_argument(
        "--models", nargs="+", choices=list(models), default=list(models), help="names of models"
    )
    options = parser.parse_args()
    effort = QUICK if options.quick else FULL
    torch.set_num_threads(1)
    masks = designs(effort)
    rendering = measure_rendering(masks, effort)
    print(
        f"Pictures per second on one core: {rendering['pictures_per_second']:.0f}; with savefig: "
        f"{rendering['savefig_per_second']:.0f}; ratio: {rendering['ratio']:.0f}\n"
    )
    print("| model | preparation of inputs, fraction of the training time |\n|---|---|")
    input_share = {}
    for name in options.models:
        input_share[name] = measure_input_share(masks, name, effort)
        print(f"| {name} | {100.0 * input_share[name]:.2f} % |")
    costs = measure_mechanics(masks, effort)
    for name in options.models:
        costs += measure_network(masks, name, effort)
    print_costs(costs)
    out = options.out or (None if options.quick else RECORD)
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        content = {
            "problem": PROBLEM, "processor": processor(), "gpu": torch.cuda.is_available(),
            "rendering": rendering, "input_share": input_share,
            "costs": [asdict(each) for each in costs],
            "provenance": provenance(torch=torch.__version__),
        }  # fmt: skip
        out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
