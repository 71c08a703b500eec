"""The process of one search.

It communicates over a pipe. It receives ``pause`` (store the state and end) or ``stop`` (also
choose a design) and sends dictionaries with ``kind``: ``progress``, and at the end ``paused``,
``stopped``, ``finished`` or ``failed``. If the server dies, the pipe closes and the search pauses.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.errors import BellcrankError, InvalidSettings, first_line
from bellcrank.storage.locking import locked

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from bellcrank.model import Design
    from bellcrank.refine.refinement import Progress as RefinementProgress
    from bellcrank.storage import RunFolder

NO_DESIGN_YET = "no admissible design has been found yet; search longer"
NICENESS = 5
WRITE_INTERVAL = 2.0
"""Seconds between two geometries of a refinement that are written, to resume it."""


class CommandListener:
    """Receives commands from the pipe in a thread.

    Attributes
    ----------
    stop
        Set when the search must end.
    command
        Latest command.
    """

    def __init__(self, pipe: Connection) -> None:
        self.stop = threading.Event()
        self.command = "pause"
        self._pipe = pipe
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        while True:
            try:
                self.command = self._pipe.recv()
            except (EOFError, OSError):
                self.command = "pause"
                self.stop.set()
                return
            self.stop.set()


def run_search(where: str, workers: int, pipe: Connection) -> None:
    """Start or resume the search of a job, until it ends or a command ends it.

    Parameters
    ----------
    where
        Folder of the job (see `bellcrank.web.jobs`).
    workers
        Number of chains at the same time.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    listener = CommandListener(pipe)
    try:
        with locked(Path(where) / "lock"):  # a process of an earlier server may still run
            outcome = _search(Path(where), workers, pipe, listener)
    except BellcrankError as error:
        outcome = {"kind": "failed", "message": first_line(error)}
    except (Exception, KeyboardInterrupt) as error:  # reported to the server, whatever it is
        outcome = {"kind": "failed", "message": f"{type(error).__name__}: {first_line(error)}"}
    with contextlib.suppress(OSError, BrokenPipeError):
        pipe.send(outcome)
        pipe.close()


def _search(
    where: Path, workers: int, pipe: Connection, listener: CommandListener
) -> dict[str, Any]:
    from bellcrank.search import read_settings
    from bellcrank.web.search_progress import ProgressReporter
    from bellcrank.workflows import complete_design
    from bellcrank.workflows.design import conclude

    if json.loads((where / "job.json").read_text(encoding="utf-8")).get("refine"):
        return _refine(where, pipe, listener)
    folder = _start_or_reopen(where)
    settings = read_settings(folder.settings)
    with ProgressReporter(pipe, folder, settings) as reporter:
        report = complete_design(
            folder,
            workers=workers,
            progress=reporter,
            verifying=reporter.verifying,
            refining=reporter.refining,
            stop=listener.stop,
        )
        if report is None and listener.command == "stop":
            try:
                # Without further refinement, which takes minutes.
                quick = replace(settings, before_refinement=False)
                refined = reporter.refined_designs()
                report = conclude(folder, quick, reporter.verifying, refined=refined)
                assert report is not None  # without a request to stop
            except InvalidSettings:
                return {"kind": "paused", "message": NO_DESIGN_YET}
            return {"kind": "stopped", **result_of(where)}
    if report is None:
        return {"kind": "paused"}
    return {"kind": "finished", **result_of(where)}


def _refine(where: Path, pipe: Connection, listener: CommandListener) -> dict[str, Any]:
    """Refine the initial design of a job, and write the result as that of a search.

    One that is resumed begins with the best geometry before.
    """
    from bellcrank.model import Design, read_design, read_problem, write_design
    from bellcrank.part import PartSpec
    from bellcrank.refine import RefinementSettings
    from bellcrank.web.refinement_progress import RefinementReporter
    from bellcrank.workflows.file_refinement import FileRefinement
    from bellcrank.workflows.refiners import GeometryCount

    job = json.loads((where / "job.json").read_text(encoding="utf-8"))
    problem, reached = read_problem(where / "problem.json"), where / "reached.json"
    is_resumed = reached.exists()
    if is_resumed:
        design = read_design(reached)
    else:
        design = Design(problem, problem.initial, provenance={"part": job["part"]})
    total = job["settings"]["steps"]
    before = job.get("done", 0) if is_resumed else 0
    part = PartSpec.from_dict(job["part"] or {}, "part")
    reporter = RefinementReporter(part, GeometryCount(most=total), only_met=False)

    written: Design | None = None
    written_at = time.monotonic()

    def write_reached(interval: float = 0.0) -> None:
        """Write the displayed design unless it is known, or was written a short time ago."""
        nonlocal written, written_at
        shown = reporter.design
        if shown is None or shown is written or time.monotonic() - written_at < interval:
            return
        write_design(replace(shown, provenance=design.provenance), reached, overwrite=True)
        written, written_at = shown, time.monotonic()

    def report(progress: RefinementProgress) -> None:
        reporter.add(0, progress)
        write_reached(WRITE_INTERVAL)
        message = {
            "kind": "progress", "points": {}, "chains": {}, "speed": None, "left": None,
            "done": before + progress.evaluations, "total": total, "tried": None,
            "refined": reporter.summary(),
        }  # fmt: skip
        if reporter.design is not None:
            message |= reporter.message(reporter.design)
        with contextlib.suppress(OSError, BrokenPipeError):
            pipe.send(message)

    left = max(total - before, total // 4)
    refinement = FileRefinement(design, RefinementSettings(evaluations=left))
    found = refinement.run(report, listener.stop)
    kind = "finished"
    if found is None:
        if listener.command != "stop":
            write_reached()
            return {"kind": "paused"}
        kind, found = "stopped", refinement.reached()
    result = found.design
    (where / "run").mkdir(exist_ok=True)
    write_design(result, where / "run" / "design.json", overwrite=True)
    is_better = found.improved or is_resumed
    message = "" if is_better else f"the design was not improved: {found.reason}"
    return {"kind": kind, "message": message, **result_of(where)}


def result_of(where: Path) -> dict[str, Any]:
    """Return the efficiency of a result, and whether it meets all items.

    Its objective in words, too, unless it is the efficiency. Of a task with tolerances it is not
    known whether all are met where random prints were not computed.
    """
    from bellcrank.fem.results import finite
    from bellcrank.model import read_design
    from bellcrank.part import PartSpec
    from bellcrank.search.verification import ELEMENTS
    from bellcrank.web.items import objective_states
    from bellcrank.workflows.specification import evaluated

    design = read_design(where / "run" / "design.json")
    job = json.loads((where / "job.json").read_text(encoding="utf-8"))
    objective = ""
    met: bool | None = None
    if design.problem.is_specified:
        found = evaluated(design.problem, design.mask, ELEMENTS)
        part = PartSpec.from_dict(job["part"] or {}, "part")
        states = [] if found is None else objective_states(design.problem, part, found)
        if states and states[0]["quantity"] != "gain":
            objective = f"{states[0]['label']} {states[0]['reached']}"
        met = found is not None and all(each.met for each in found.results())
        wanted = design.problem.specification
        if met and wanted is not None and wanted.tolerances is not None:
            met = _prints_pass(where / "run" / "summary.json", wanted.tolerances.least_yield)
    efficiency = None if design.efficiency is None else finite(design.efficiency)
    return {"efficiency": efficiency, "objective": objective, "met": met}


def _prints_pass(summary: Path, least: float) -> bool | None:
    """Return whether enough random prints meet all items; None where they were not computed."""
    if not summary.exists():
        return None
    found = json.loads(summary.read_text(encoding="utf-8"))["tolerance"]
    return None if found is None else bool(found["yield"] >= least)


def _start_or_reopen(where: Path) -> RunFolder:
    from bellcrank.model import read_problem
    from bellcrank.part import PartSpec
    from bellcrank.search import read_settings
    from bellcrank.workflows import reopen_design, start_design

    run = where / "run"
    if (run / "run.json").exists():
        return reopen_design(run)
    job = json.loads((where / "job.json").read_text(encoding="utf-8"))
    part = PartSpec.from_dict(job["part"]) if job["part"] is not None else None
    settings = read_settings(job["settings"])
    return start_design(read_problem(where / "problem.json"), settings, run, part)
