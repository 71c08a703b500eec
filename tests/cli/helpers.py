"""The command line called in this process, and what runs leave behind."""

from __future__ import annotations

import contextlib
import io
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest import mock

import numpy as np
import pyarrow.parquet as pq
from matplotlib.image import imread

from bellcrank.cli import console, main

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PROBLEM = "scaling-8"
SETTINGS = ("--model", "springs", "--steps", "1500", "--chains", "2", "--seed", "5")
ROWS = 3000
BLOCKS = 12
"""Of 250 steps, in both chains together."""
OTHER_VERSION = "note: this run was started with another version ("
STROKE = "input: "

SMALL = {
    "schema": "bellcrank/problem/1",
    "name": "small",
    "positions": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 2.0], [1.0, 2.0]],
    "beams": [[0, 1], [0, 2], [1, 3], [2, 3], [1, 2], [2, 4], [3, 5], [4, 5]],
    "initial": "ff",
    "designable": [3, 4, 5, 6],
    "stiffness": {"bond": 5.0, "angle": 0.1},
    "supports": {"fixed": [0], "fixed_x": [], "fixed_y": [1]},
    "input": {"nodes": [5], "direction": [0.0, -1.0], "drive": "displacement", "amount": 0.1},
    "output": {"nodes": [4], "direction": [-1.0, 0.0], "spring": None, "spring_kind": None},
    "aggregate": "mean",
}

LIFT = """
schema = "bellcrank/problem/1"
name = "lift"

[lattice]
kind = "triangular-rows"
counts = [5, 6, 5, 6, 5, 6]
first_x = [0.5, 0.0, 0.5, 0.0, 0.5, 0.0]

[supports]
fixed = [{ row = 0 }]

[input]
nodes = [{ row = -1, rightmost = 2 }]
direction = [0, -1]
drive = "displacement"
amount = 0.2

[output]
nodes = [{ row = -1, leftmost = 2 }]
direction = [0, 1]
"""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a command ended, and what it said."""

    code: int
    out: str
    err: str

    @property
    def complaints(self) -> str:
        """Standard error without the stroke, and without the note of another version."""
        lines = self.err.splitlines(keepends=True)
        return "".join(line for line in lines if not line.startswith((OTHER_VERSION, STROKE)))

    @property
    def data(self) -> Any:
        """Standard output as JSON; all of it, or this fails."""
        return json.loads(self.out)


def call(*words: object, width: int = 10_000) -> Outcome:
    """Run `bellcrank` with these words in this process, on a terminal of some width."""
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        mock.patch("sys.argv", ["bellcrank", *map(str, words)]),
        mock.patch.object(console.notes, "_width", width),
        mock.patch.object(console.results, "_width", width),
    ):
        try:
            main()
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return Outcome(code, out.getvalue(), err.getvalue())


def files(folder: Path) -> dict[str, bytes | None]:
    """Everything under a folder, hidden or not, with its content."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


def refusal(*words: object, code: int = 2, folder: Path | None = None) -> str:
    """Run a command that must be refused in one line and write nothing; return that line."""
    folder = folder or Path.cwd()
    before = files(folder)
    outcome = call(*words, width=80)
    assert outcome.out == ""
    assert outcome.err.startswith("error: "), outcome.err
    assert outcome.err.count("\n") == 1, outcome.err
    assert outcome.err.endswith("\n")
    assert "Traceback" not in outcome.err
    assert outcome.code == code
    assert files(folder) == before
    return outcome.err.strip()


def write(path: Path, content: object) -> Path:
    """Write text, or anything that JSON can hold, to a file."""
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


@contextlib.contextmanager
def failing_from(name: str, instant: int, error: int) -> Iterator[list[None]]:
    """Let a call to the system fail from the one of that number on; yield the calls so far."""
    real: Callable[..., Any] = getattr(os, name)
    calls: list[None] = []

    def call_or_fail(*words: Any, **options: Any) -> Any:
        calls.append(None)
        if len(calls) > instant:
            raise OSError(error, os.strerror(error))
        return real(*words, **options)

    with mock.patch.object(os, name, call_or_fail):
        yield calls


def table(folder: Path) -> dict[str, list[Any]]:
    """Every column of the history; numbers as their bits, so that NaN equals itself."""
    read = pq.read_table(folder / "history.parquet")
    return {
        name: [
            value.hex() if isinstance(value, float) else value
            for value in read.column(name).to_pylist()
        ]
        for name in read.column_names
    }


def design_of(folder: Path) -> dict[str, Any]:
    """Return what the design of a run is, without when and where it was made."""
    data = json.loads((folder / "design.json").read_text())
    return {key: data[key] for key in ("problem", "mask", "efficiency")}


def colours(path: Path) -> int:
    """Count the distinct colours of a picture."""
    levels = np.round(255 * imread(path)[..., :3]).astype(np.int64)
    return len(np.unique(levels @ (1, 256, 65536)))


RESULTS = [
    "design.json", "efficiency.png", "history.parquet", "motion.png", "run.json",
    "summary.json", "summary.md",
]  # fmt: skip
PART_RESULTS = sorted([*RESULTS, "validation.json"])


def assert_same_run(folder: Path, whole: Path) -> None:
    """Check that a run ended as the uninterrupted one did, to the last bit."""
    found, expected = table(folder), table(whole)
    assert list(found) == list(expected)
    for name, column in expected.items():
        assert found[name] == column, name
    assert design_of(folder) == design_of(whole)
    assert sorted(files(folder)) == RESULTS
    described, told = (json.loads((path / "run.json").read_text()) for path in (folder, whole))
    assert described["status"] == "finished"
    assert described["settings"] == told["settings"]
    summaries = [json.loads((path / "summary.json").read_text()) for path in (folder, whole)]
    assert summaries[0] == summaries[1]
