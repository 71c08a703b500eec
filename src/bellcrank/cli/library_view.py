"""What `bellcrank library` prints: entries in a table, and all that is known of one."""

from __future__ import annotations

import json
import math
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from bellcrank.cli.console import notes, number_of, plain, print_json, results
from bellcrank.cli.live import Live

if TYPE_CHECKING:
    from bellcrank.machines.library import Entry, Library, Made, Order, Summary, Task
    from bellcrank.search import Progress


class MakingProgress(Live):
    """A live line: which entry is searched for, and a line for each that is made.

    Parameters
    ----------
    order
        What is to be made.
    """

    def __init__(self, order: Order) -> None:
        self._each = order.steps * order.chains
        self._total = len(order.tasks)
        self._finished = self._steps = 0
        self._lock = threading.Lock()
        super().__init__("making", self._total * self._each)

    def __call__(self, task: Task, step: Progress) -> None:
        """Take in the news of one chain."""
        with self._lock:
            self._steps += step.steps
            line = f"{self._finished + 1} of {self._total}  {task.name}"
            done = self._finished * self._each + min(self._steps, self._each)
            self._show(done, self._total * self._each, line, f"{line}  {self._steps} steps")

    def finish(self, made: Made, elapsed: float) -> None:
        """Say what became of a task."""
        with self._lock:
            self._finished, self._steps = made.number + 1, 0
        what = made.note
        if made.entry is not None:
            what = entry_line(made.entry) + made.note.removeprefix("made")
        notes.print(
            f"{made.number + 1:3d} of {made.total}  {plain(made.task.name)}: {plain(what)}"
            f"  ({made.seconds:.0f} s, {elapsed:.0f} s in all)"
        )


def warn(known: Library) -> None:
    """Say which files of the library cannot be read."""
    for line in known.damaged:
        notes.print(f"[yellow]left out:[/] {plain(line)}")


def print_entries(
    known: Library, found: list[Summary], *, as_json: bool, spring: float = 0.0
) -> None:
    """Print entries, a line each."""
    from bellcrank.machines.library.summary import summary_to_dict

    if as_json:
        print_json(json.dumps([summary_to_dict(each) for each in found], indent=1))
        warn(known)
        return
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("name", no_wrap=True)
    for heading in (
        "as\nmade", f"against\n{spring:g}" if spring else "free,\nat rest", "plain\nlever",
        "frame\nFEM", "input\nstiff.", "output\nstiff.",
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
            + ("" if each.clear else "!"),
            _figure(each.input_stiffness, 3),
            _figure(port.output_stiffness, 3),
        )
    results.print(table)
    worse = len(found) - sum(each.better for each in found)
    said = "1 entry" if len(found) == 1 else f"{len(found)} entries"
    unclear = len(found) - sum(each.clear for each in found)
    marks = {"* the plain lever is better": worse, "! struts touch, or it may snap": unclear}
    results.print(f"\n{said}, lattice units")
    for text, count in marks.items():
        if count:
            results.print(f"{text} ({count})")
    warn(known)


def entry_line(entry: Entry) -> str:
    """Return an entry in a line."""
    lever = _figure(entry.lever.efficiency)
    return f"{entry.name}  efficiency {entry.efficiency:.3f}, plain lever {lever}"


def print_entry(entry: Entry, path: Path) -> None:
    """Print all that is known of an entry."""
    rest, check = entry.characterisation.rest, entry.validation
    told = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    lever = _figure(entry.lever.efficiency)
    if entry.lever.unbound_efficiency > entry.lever.efficiency:
        lever += f" ({_figure(entry.lever.unbound_efficiency)} without its goals)"
    spring = entry.design.problem.output.spring
    rows = [
        ("name", entry.name),
        ("made for", _made_for(entry)),
        ("beams", str(entry.design.beam_count)),
        ("efficiency" + (f", springs of {spring:g}" if spring else ""), _figure(entry.efficiency)),
        ("plain lever", lever + ("" if entry.better else ": better")),
        ("  which is", entry.lever.shape or "none that is stable and keeps the goals"),
        ("frame FEM", _frame(entry)),
        ("  part", f"{check.material}, struts {check.width:g} mm, {check.scale:g} mm a unit"),
        ("at rest, free efficiency", _figure(rest.efficiency)),
        ("  input stiffness", _figure(rest.input_stiffness)),
        ("  output stiffness", _figure(rest.output_stiffness)),
        ("  blocked force per motion", _figure(rest.transmitted_stiffness)),
        ("  best spring", f"{_figure(rest.matched_spring)}, {rest.best_work_share:.1%} of work"),
    ]  # fmt: skip
    for curve in entry.characterisation.curves:
        way = "" if curve.reached >= 1.0 else f", {curve.status.label} at {curve.reached:.1%}"
        end = (
            f"output {_figure(curve.output[-1])}, force {_figure(-curve.output_force[-1])}, "
            f"for {_figure(curve.motion[-1])} with {_figure(curve.input_force[-1])}"
        )
        rows.append((f"stroke, {curve.load.label}", end + way))
    rows += [("origin", _origin(entry)), ("file", str(path))]
    for label, value in rows:
        told.add_row(label, plain(value))
    results.print(told)
    for line in (*check.warnings, *entry.characterisation.doubts):
        notes.print(f"[yellow]note:[/] {plain(line)}")


def _made_for(entry: Entry) -> str:
    from bellcrank.machines.library import kinds

    size = "" if entry.columns is None else f", {entry.columns} columns"
    about = f": {kinds[entry.kind].about}" if entry.kind in kinds else ""
    return f"output {entry.direction}{size}, {entry.kind}{about}"


def _frame(entry: Entry) -> str:
    check = entry.validation
    known = math.isfinite(check.efficiency)
    value = _figure(check.efficiency) if known else f"{check.status} at {check.reached:.1%}"
    return (
        f"{value} (linear {_figure(check.linear_efficiency)}), strain {check.strain:.1%}, "
        f"stress {check.stress:.3g} MPa"
    )


def _origin(entry: Entry) -> str:
    """Return where an entry comes from, in a line."""
    told = entry.provenance
    settings = told.get("settings")
    made = f"version {told.get('version')}, {str(told.get('time'))[:10]}"
    if not isinstance(settings, dict):
        return f"a design of its own, measured by {made}"
    return (
        f"{settings.get('search')}, {number_of(int(settings.get('chains', 0)), 'chain')} of "
        f"{settings.get('steps')} steps, seed {settings.get('seed')}; {made}"
    )


def _figure(value: float, digits: int = 4) -> str:
    """Return some digits; what is no number is a dash."""
    if not math.isfinite(value):
        return "-"
    return "0" if abs(value) < 1e-12 else f"{value:.{digits}g}"
