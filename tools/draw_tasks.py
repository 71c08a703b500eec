"""Pictures and movies of the bundled tasks for the documentation: ``python -m tools.draw_tasks``.

For each task, the run of ``docs/tasks/runs.json`` or ``docs/space/runs.json`` that meets the most
(by frames, then in the sheet) with the smallest seed is drawn: ``docs/tasks/NAME.png`` with the
paths of the outputs, and ``docs/tasks/NAME.gif``. Both contain the identity of the run, by which a
test finds those of earlier runs. ``--only NAME,NAME`` draws some.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from pathlib import Path
from typing import Any

from PIL import Image, ImageSequence, PngImagePlugin

from bellcrank.plots import draw_cases
from bellcrank.plots.movies import MovieSettings
from bellcrank.task import find_task
from bellcrank.workflows.animate import animate_motion
from bellcrank.workflows.part_figures import part_figures
from bellcrank.workflows.pictures import case_motions
from benchmarks.tasks import recorded_design

DOCS = Path(__file__).parents[1] / "docs"
FOLDER = DOCS / "tasks"
RECORD = FOLDER / "runs.json"
RECORD_IN_SPACE = DOCS / "space" / "runs.json"
MOVIE = MovieSettings(seconds=2.0, fps=10, size=(640, 360))


def recorded_runs() -> list[dict[str, Any]]:
    """Return the runs of the records of tasks in the plane and in space."""
    runs: list[dict[str, Any]] = json.loads(RECORD.read_text(encoding="utf-8"))["runs"]
    in_space = json.loads(RECORD_IN_SPACE.read_text(encoding="utf-8"))["runs"]
    for name, run in in_space.items():
        kind, _, task = name.partition(" ")
        if kind == "tasks":
            runs.append({**run, "task": task, "met_in_sheet": run["met_in_solid"]})
    return runs


def best(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the run that is drawn."""
    made = [run for run in runs if "mask" in run]
    return min(made, key=lambda run: (not run["met"], not run["met_in_sheet"], run["seed"]))


def identity(run: dict[str, Any]) -> str:
    """Return a hash of the design of a run."""
    design = [run["mask"], run["positions"], run["widths"]]
    return hashlib.sha256(json.dumps(design).encode()).hexdigest()


def identity_in(path: Path) -> str | None:
    """Return the identity of the run that a picture or a movie shows; None if it has none."""
    with Image.open(path) as picture:
        found = picture.info.get("comment")
    return found.decode() if isinstance(found, bytes) else found


def shrink(path: Path, comment: str, largest: int = 800) -> None:
    """Make a picture or a movie smaller, and add a comment.

    At most `largest` pixels, one palette of 64 colours.
    """
    source = Image.open(path)
    frames, durations = [], []
    for frame in ImageSequence.Iterator(source):
        picture = frame.convert("RGB")
        picture.thumbnail((largest, largest))
        frames.append(picture)
        durations.append(frame.info.get("duration", 0))
    width, height = frames[0].size
    together = Image.new("RGB", (width, height * len(frames)))
    for index, picture in enumerate(frames):
        together.paste(picture, (0, height * index))
    palette = together.quantize(64, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    first, *others = (
        picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in frames
    )
    if path.suffix == ".gif":
        first.save(
            path, save_all=True, append_images=others, duration=durations, loop=0, comment=comment
        )
    else:
        texts = PngImagePlugin.PngInfo()
        texts.add_text("comment", comment)
        first.save(path, optimize=True, pnginfo=texts)


def main() -> None:
    """Draw the tasks that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    runs = recorded_runs()
    names = given.only.split(",") if given.only else sorted({run["task"] for run in runs})
    for name in names:
        task = find_task(name)
        if task is None:  # a load case alone
            continue
        run = best([run for run in runs if run["task"] == name])
        design = recorded_design(task, run)
        motions = case_motions(design, task.part, part_figures(design, task.part))
        draw_cases(motions, FOLDER / f"{name}.png", overwrite=True)
        shrink(FOLDER / f"{name}.png", identity(run))
        animate_motion([(name, design)], FOLDER / f"{name}.gif", MOVIE, overwrite=True)
        shrink(FOLDER / f"{name}.gif", identity(run))
        print(name, flush=True)


if __name__ == "__main__":
    main()
