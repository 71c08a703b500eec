"""Output of `bellcrank library`: a table of entries, one entry, progress."""

from __future__ import annotations

import json
import math
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from bellcrank.cli.console import notes, number_of, plain, print_json, results
from bellcrank.cli.live import Live
from bellcrank.part.units import GRAVITY

if TYPE_CHECKING:
    from bellcrank.machines.library import Entry, Library, Summary
    from bellcrank.machines.library.tasks import EntryTask, MakeSettings
    from bellcrank.search import Progress
    from bellcrank.workflows.library_making import TaskOutcome


class MakingProgress(Live):
    """Progress of the searches, and one line for each task that is done.

    Parameters
    ----------
    settings
        Entries to make.
    """

    def __init__(self, settings: MakeSettings) -> None:
        self._each = settings.steps * settings.chains
        self._total = len(settings.tasks)
        self._finished = self._steps = 0
        self._lock = threading.Lock()
        super().__init__("making", self._total * self._each)

    def __call__(self, task: EntryTask, step: Progress) -> None:
        """Record the progress of one chain."""
        with self._lock:
            self._steps += step.steps
            line = f"{self._finished + 1} of {self._total}  {task.name}"
            done = self._finished * self._each + min(self._steps, self._each)
            self._show(done, self._total * self._each, line, f"{line}  {self._steps} steps")

    def finish(self, outcome: TaskOutcome, elapsed: float) -> None:
        """Print the outcome of a task."""
        with self._lock:
            self._finished, self._steps = outcome.number + 1, 0
        text = outcome.note
        if outcome.entry is not None:
            text = entry_line(outcome.entry) + outcome.note.removeprefix("made")
        notes.print(
            f"{outcome.number + 1:3d} of {outcome.total}  {plain(outcome.task.name)}: {plain(text)}"
            f"  ({outcome.seconds:.0f} s, {elapsed:.0f} s in total)"
        )


def warn(known: Library) -> None:
    """Print which files of the library cannot be read."""
    for line in known.damaged:
        notes.print(f"[yellow]skipped:[/] {plain(line)}")


def print_entries(
    known: Library, found: list[Summary], *, as_json: bool, spring: float = 0.0
) -> None:
    """Print one line for each entry."""
    if as_json:
        print_json(json.dumps([each.to_dict() for each in found], indent=1))
        warn(known)
        return
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("name", no_wrap=True)
    last = f"gain,\nspring {spring:g}" if spring else "sag\nmm"
    for heading in (
        "gain\n", "travel\nmm", "off-\naxis", "rot.\ndeg", "payload\ng", last,
    ):  # fmt: skip
        table.add_column(heading, justify="right", no_wrap=True)
    for each in found:
        table.add_row(
            plain(each.name),
            _figure(each.gain, 3) + ("!" if each.warnings else ""),
            _figure(each.travel_mm, 3),
            "-" if math.isnan(each.off_axis) else f"{each.off_axis:.0%}",
            _figure(each.rotation_deg, 2),
            "-" if math.isnan(each.payload_N) else f"{1e3 * each.payload_N / GRAVITY:.0f}",
            _figure(each.two_port.efficiency_against(spring) if spring else each.sag_mm, 2),
        )
    results.print(table)
    count = "1 entry" if len(found) == 1 else f"{len(found)} entries"
    results.print(f"\n{count}; parts of struts 2 mm wide on 10 mm, frames of 8 elements a strut")
    if spring:
        results.print("gain against a spring: at rest, with the spring in lattice units")
    if warned := sum(each.warnings for each in found):
        results.print(f"! struts in contact, or loss of stability ({warned})")
    warn(known)


def entry_line(entry: Entry) -> str:
    """Return one line about an entry."""
    return f"{entry.name}  gain {entry.efficiency:.3f}"


def print_entry(entry: Entry, path: Path) -> None:
    """Print an entry."""
    rest, check = entry.characterisation.rest, entry.validation
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    rows = [
        ("name", entry.name),
        ("designed for", _designed_for(entry)),
        ("beams", str(entry.design.beam_count)),
        ("part", f"{check.material}, struts {check.width:g} mm, spacing {check.scale:g} mm"),
        ("  frame analysis", _frame(entry)),
        *_part_rows(entry),
        ("at rest, free efficiency", _figure(rest.efficiency)),
        ("  input stiffness", _figure(rest.input_stiffness)),
        ("  output stiffness", _figure(rest.output_stiffness)),
        ("  blocked force per motion", _figure(rest.transmitted_stiffness)),
        ("  matched spring", f"{_figure(rest.matched_spring)}, {rest.best_work_share:.1%} of work"),
    ]  # fmt: skip
    for curve in entry.characterisation.curves:
        end = (
            f"output {_figure(curve.output[-1])} (force {_figure(-curve.output_force[-1])}), "
            f"input {_figure(curve.motion[-1])} (force {_figure(curve.input_force[-1])})"
        )
        if curve.reached < 1.0:
            end += f", {curve.status.label} at {curve.reached:.1%}"
        rows.append((f"stroke, {curve.load.label}", end))
    rows += [("origin", _origin(entry)), ("file", str(path))]
    for label, value in rows:
        table.add_row(label, plain(value))
    results.print(table)
    for line in entry.warnings:
        notes.print(f"[yellow]warning:[/] {plain(line)}")


def _designed_for(entry: Entry) -> str:
    from bellcrank.machines.library import kind_title

    size = "" if entry.columns is None else f", {entry.columns} columns"
    return f"output {entry.direction}{size}, {kind_title(entry.kind)}"


def _part_rows(entry: Entry) -> list[tuple[str, str]]:
    """Return the figures of the part as rows; of springs, the efficiency alone."""
    from bellcrank.workflows.report_tables import figure_texts

    if not entry.figures:
        return [("  efficiency", _figure(entry.efficiency))]
    return [(f"  {label}", text) for label, text in figure_texts(entry.figures)]


def _frame(entry: Entry) -> str:
    check = entry.validation
    exists = math.isfinite(check.efficiency)
    value = _figure(check.efficiency) if exists else f"{check.status} at {check.reached:.1%}"
    return (
        f"{value} (linear {_figure(check.linear_efficiency)}), strain {check.strain:.1%}, "
        f"stress {check.stress:.3g} MPa"
    )


def _origin(entry: Entry) -> str:
    """Return one line about the origin of an entry."""
    origin = entry.provenance
    settings = origin.get("settings")
    made = f"version {origin.get('version')}, {str(origin.get('time'))[:10]}"
    if not isinstance(settings, dict):
        return f"added design, measured by {made}"
    return (
        f"{settings.get('search')}, {number_of(int(settings.get('chains', 0)), 'chain')} of "
        f"{settings.get('steps')} steps, seed {settings.get('seed')}; {made}"
    )


def _figure(value: float, digits: int = 4, unit: str = "") -> str:
    """Return some digits and the unit, or a dash for a value that is not finite."""
    if not math.isfinite(value):
        return "-"
    return f"0{unit}" if abs(value) < 1e-12 else f"{value:.{digits}g}{unit}"
