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
    for heading in (
        "design\nload", f"spring\n{spring:g}" if spring else "free,\nat rest", "plain\nlever",
        "frame", "input\nstiff.", "output\nstiff.",
    ):  # fmt: skip
        table.add_column(heading, justify="right", no_wrap=True)
    for each in found:
        port = each.two_port
        table.add_row(
            plain(each.name),
            _figure(each.efficiency, 3),
            _figure(port.efficiency_against(spring), 3),
            _figure(each.lever_efficiency, 3) + ("" if each.better else "*"),
            (_figure(each.frame_efficiency, 3) if each.frame_status == "converged" else "snaps")
            + ("!" if each.warnings else ""),
            _figure(each.input_stiffness, 3),
            _figure(port.output_stiffness, 3),
        )
    results.print(table)
    worse = len(found) - sum(each.better for each in found)
    count = "1 entry" if len(found) == 1 else f"{len(found)} entries"
    warned = sum(each.warnings for each in found)
    marks = {"* the plain lever is better": worse, "! struts in contact, or snap-through": warned}
    results.print(f"\n{count}; efficiencies and stiffnesses in lattice units")
    for text, number in marks.items():
        if number:
            results.print(f"{text} ({number})")
    warn(known)


def print_parts(known: Library, found: list[Summary]) -> None:
    """Print one line for each entry with the figures of its part."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("name", no_wrap=True)
    for heading in ("gain", "travel", "off-axis", "rotation", "payload", "sag"):
        table.add_column(heading, justify="right", no_wrap=True)
    for each in found:
        off_axis = "-" if math.isnan(each.off_axis) else f"{each.off_axis:.0%}"
        table.add_row(
            plain(each.name), _figure(each.gain, 3), _figure(each.travel_mm, 3, " mm"), off_axis,
            _figure(each.rotation_deg, 2, " deg"), _figure(1e3 * each.payload_N / GRAVITY, 2, " g"),
            _figure(each.sag_mm, 2, " mm"),
        )  # fmt: skip
    results.print(table)
    count = "1 entry" if len(found) == 1 else f"{len(found)} entries"
    results.print(
        f"\n{count}; parts of struts 2 mm wide on 10 mm, by frames with 8 elements in each strut"
    )
    warn(known)


def entry_line(entry: Entry) -> str:
    """Return one line about an entry."""
    lever = _figure(entry.lever.efficiency)
    return f"{entry.name}  efficiency {entry.efficiency:.3f}, plain lever {lever}"


def print_entry(entry: Entry, path: Path) -> None:
    """Print an entry."""
    rest, check = entry.characterisation.rest, entry.validation
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    lever = _figure(entry.lever.efficiency)
    if entry.lever.unbound_efficiency > entry.lever.efficiency:
        lever += f" ({_figure(entry.lever.unbound_efficiency)} without the constraints)"
    spring = entry.design.problem.output.spring
    rows = [
        ("name", entry.name),
        ("designed for", _designed_for(entry)),
        ("beams", str(entry.design.beam_count)),
        ("efficiency" + (f", springs of {spring:g}" if spring else ""), _figure(entry.efficiency)),
        ("plain lever", lever + ("" if entry.better else ": more efficient")),
        ("  shape", entry.lever.shape or "none is stable and satisfies the constraints"),
        ("frame analysis", _frame(entry)),
        ("  part", f"{check.material}, struts {check.width:g} mm, spacing {check.scale:g} mm"),
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
    from bellcrank.machines.library import kind_title, kinds

    size = "" if entry.columns is None else f", {entry.columns} columns"
    about = f": {kinds[entry.kind].about}" if entry.kind in kinds else ""
    return f"output {entry.direction}{size}, {kind_title(entry.kind)}{about}"


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
