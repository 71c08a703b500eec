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
from typing import TYPE_CHECKING, Any, Self

from bellcrank.errors import BellcrankError, InvalidSettings, first_line
from bellcrank.model import pack_mask, unpack_mask
from bellcrank.storage.locking import locked

if TYPE_CHECKING:
    from collections.abc import Collection
    from multiprocessing.connection import Connection

    from bellcrank.mechanics import Response
    from bellcrank.model import Design, Problem
    from bellcrank.part import PartSpec
    from bellcrank.refine.refinement import Progress as RefinementProgress
    from bellcrank.search import Progress, SearchSettings, SpecificationEvaluator
    from bellcrank.storage import RunFolder
    from bellcrank.web.curves import Point

NO_DESIGN_YET = "no admissible design has been found yet; search longer"
INTERVAL = 0.1
"""Seconds between two messages."""
MOVED_INTERVAL = 0.4
"""Seconds between two evaluations of the displayed design."""
NICENESS = 5


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


class ProgressReporter:
    """Collects the progress of the chains and sends it ten times a second."""

    def __init__(self, pipe: Connection, folder: RunFolder, settings: SearchSettings) -> None:
        from bellcrank.mechanics import model_evaluator
        from bellcrank.part import PartSpec
        from bellcrank.search import symmetry_groups
        from bellcrank.web.quick_calls import specification_of
        from bellcrank.workflows.refiners import GeometryCount

        self._pipe = pipe
        self._problem = folder.problem
        self._groups = symmetry_groups(folder.problem, settings)
        self._specification = specification_of(folder.problem)
        self._evaluator = self._specification or model_evaluator(folder.problem)
        self._part = PartSpec.from_dict(folder.provenance.get("part") or {}, "part")
        self._refinement = RefinementDisplay(self._part)
        self._total = settings.chains * settings.steps
        self._lock = threading.Lock()
        self._chains: dict[int, dict[str, Any]] = {}
        self._scores: dict[int, float] = {}
        self._points: dict[int, list[Point]] = {}
        self._made = 0
        self._start = time.monotonic()
        self._moved_at, self._moved_mask = 0.0, ""
        self._tried: tuple[int, int] | None = None
        self._refined: dict[int, RefinementProgress] = {}
        self._geometries = GeometryCount(settings.chains)
        self._done = {chain: folder.progress(chain)[0] for chain in range(settings.chains)}
        self._points.update(self._first_points(settings))
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._send_regularly, daemon=True)

    def _first_points(self, settings: SearchSettings) -> dict[int, list[Point]]:
        """Return the first point of the curve of each chain that has not started."""
        from bellcrank.web.curves import rounded

        initial = self._groups.expand(self._groups.problem.initial)
        efficiency = rounded(self._evaluator.evaluate(initial).efficiency)
        temperature = float(getattr(settings, "temperatures", [0.0])[0])
        point = (0, efficiency, efficiency, temperature)
        return {chain: [point] for chain, done in self._done.items() if not done}

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()

    def __call__(self, progress: Progress) -> None:
        """Record the progress of one chain."""
        state = progress.state
        now, best = _met_score(state.efficiency), _met_score(state.best)
        with self._lock:
            self._made += progress.steps
            self._done[progress.chain] = state.step
            self._scores[progress.chain] = state.best
            self._chains[progress.chain] = {
                "step": state.step,
                "efficiency": now,
                "best": best,
                "temperature": progress.temperature,
                "accepted": state.accepted,
                "mask": _current_mask(state),
                "kept": _best_mask(state),
            }
            point = (state.step, now, best, round(progress.temperature, 6))
            self._points.setdefault(progress.chain, []).append(point)

    def verifying(self, done: int, total: int) -> None:
        """Record how many candidates have been verified, and the largest number."""
        with self._lock:
            self._tried = done, total

    def refining(self, number: int, progress: RefinementProgress) -> None:
        """Record the progress of the refinement of a design."""
        with self._lock:
            self._refined[number] = progress
            self._geometries.add(number, progress.evaluations)
            self._refinement.add(number, progress)

    def refined_designs(self) -> list[Design]:
        """Return the best design of each refinement that meets all items, the best first."""
        with self._lock:
            return self._refinement.designs()

    def _send_regularly(self) -> None:
        while not self._end.wait(INTERVAL):
            with contextlib.suppress(OSError, BrokenPipeError):
                self._send()
        with contextlib.suppress(OSError, BrokenPipeError):
            self._send()

    def _send(self) -> None:
        with self._lock:
            if not self._chains:
                return
            points, self._points = self._points, {}
            chains = {chain: self._whole(state) for chain, state in self._chains.items()}
            done, made, tried = sum(self._done.values()), self._made, self._tried
            refined, scores = dict(self._refined), dict(self._scores)
            done_refined, most_refined = self._geometries.done, self._geometries.most
            shape = self._refinement.design
        speed = made / max(time.monotonic() - self._start, 1e-9)
        message: dict[str, Any] = {
            "kind": "progress",
            "points": points,
            "chains": chains,
            "speed": round(speed, 1),
            "done": done,
            "total": self._total,
            "left": round((self._total - done) / max(speed, 1e-9), 1),
            "tried": tried,
            "refined": _refinement_of(refined.values(), done_refined, most_refined),
        }
        best = chains[max(scores, key=scores.__getitem__)]
        if shape is not None:
            message |= self._refinement.message(shape)
        elif (
            time.monotonic() - self._moved_at > MOVED_INTERVAL and best["kept"] != self._moved_mask
        ):
            message["moved"] = self._move(best["kept"])
        self._pipe.send(message)

    def _whole(self, state: dict[str, Any]) -> dict[str, Any]:
        """Return the state of a chain with all images of the beams of its designs."""
        count = self._problem.lattice.beam_count
        masks = {
            name: pack_mask(self._groups.expand(unpack_mask(state[name], count)))
            for name in ("mask", "kept")
        }
        return {**state, **masks}

    def _move(self, mask: str) -> dict[str, Any]:
        """Return the response of the displayed design."""
        bits = unpack_mask(mask, self._problem.lattice.beam_count)
        response = self._evaluator.evaluate(bits)
        self._moved_at, self._moved_mask = time.monotonic(), mask
        shown = displayed(self._problem, self._part, response, self._specification)
        return {"mask": mask, "problem": None, **shown}


class RefinementDisplay:
    """The best geometries of refinements, and the best of all for the page.

    Attributes
    ----------
    design
        The design that is shown; None before the first geometry that meets all items.
    """

    def __init__(self, part: PartSpec, *, only_met: bool = True) -> None:
        self.design: Design | None = None
        self._part, self._only_met = part, only_met
        self._best: dict[int, RefinementProgress] = {}
        self._sent: Design | None = None
        self._sent_at = 0.0

    def add(self, number: int, progress: RefinementProgress) -> None:
        """Record a geometry of the refinement of a design."""
        from bellcrank.refine.by_frames import MET

        if progress.design is None:
            return
        if progress.rows.violation > MET:
            if not self._only_met and not self._best:
                self.design = progress.design
            return
        best = self._best.get(number)
        if best is None or progress.rows.objective > best.rows.objective:
            self._best[number] = progress
            self.design = self.designs()[0]

    def designs(self) -> list[Design]:
        """Return the best design of each refinement that meets all items, the best first."""
        found = sorted(self._best.values(), key=lambda each: -each.rows.objective)
        return [each.design for each in found if each.design is not None]

    def message(self, design: Design) -> dict[str, Any]:
        """Return the response of a design for the page; empty if it was sent, or too soon."""
        from bellcrank.model import problem_to_dict
        from bellcrank.web.quick_calls import specification_of

        if design is self._sent or time.monotonic() - self._sent_at < MOVED_INTERVAL:
            return {}
        evaluator = specification_of(design.problem)
        assert evaluator is not None
        shown = displayed(design.problem, self._part, evaluator.evaluate(design.mask), evaluator)
        self._sent, self._sent_at = design, time.monotonic()
        problem = problem_to_dict(design.problem)
        return {"moved": {"mask": design.mask_hex, "problem": problem, **shown}}


def displayed(
    problem: Problem,
    part: PartSpec,
    response: Response,
    specification: SpecificationEvaluator | None,
) -> dict[str, Any]:
    """Return motion, items and objectives of the design evaluated last for the page."""
    from bellcrank.fem.results import finite
    from bellcrank.web.items import item_states, objective_states
    from bellcrank.web.quick_calls import flat

    shown, items, objectives = response.is_admissible, None, []
    if shown and specification is not None:
        items = item_states(problem, part, specification.results())
        objectives = objective_states(problem, part, specification)
    return {
        "efficiency": finite(response.efficiency),
        "displacement": flat(response.displacement) if shown else None,
        "items": items,
        "objectives": objectives,
    }


def _refinement_of(
    latest: Collection[RefinementProgress], done: int, most: int
) -> dict[str, Any] | None:
    """Return how far refinements are: designs, geometries, sheets, the best objective.

    The objective is that of designs that meet all items.
    """
    from bellcrank.refine.by_frames import MET

    if not latest:
        return None
    met = [each.rows.objective for each in latest if each.rows.violation <= MET]
    return {
        "designs": len(latest),
        "geometries": done,
        "sheets": sum(each.sheets for each in latest),
        "most": most,
        "objective": float(max(met)) if met else None,
    }


def _met_score(value: float) -> float | None:
    """Return a score rounded for drawing; None for a design that misses items or constraints."""
    from bellcrank.search.constraints.evaluator import BASE_PENALTY
    from bellcrank.web.curves import rounded

    return rounded(value) if value > -0.5 * BASE_PENALTY else None


def _current_mask(state: Any) -> str:
    """Return the current design of a chain, during a local search that of the local search."""
    return str(getattr(state, "current", None) or _best_mask(state))


def _best_mask(state: Any) -> str:
    """Return the best design of a chain if its state has it, else the current one."""
    return str(state.mask if isinstance(state.mask, str) else state.mask[-1])


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
            return {"kind": "stopped", "efficiency": report.selection.efficiency_after}
    if report is None:
        return {"kind": "paused"}
    return {"kind": "finished", "efficiency": report.selection.efficiency_after}


def _refine(where: Path, pipe: Connection, listener: CommandListener) -> dict[str, Any]:
    """Refine the initial design of a job, and write the result as that of a search."""
    from bellcrank.fem.results import finite
    from bellcrank.model import Design, read_problem, write_design
    from bellcrank.part import PartSpec
    from bellcrank.refine import RefinementSettings
    from bellcrank.workflows.refinement import refine_file

    job = json.loads((where / "job.json").read_text(encoding="utf-8"))
    problem = read_problem(where / "problem.json")
    design = Design(problem, problem.initial, provenance={"part": job["part"]})
    total = job["settings"]["steps"]
    display = RefinementDisplay(PartSpec.from_dict(job["part"] or {}, "part"), only_met=False)

    def report(progress: RefinementProgress) -> bool:
        display.add(0, progress)
        message = {
            "kind": "progress", "points": {}, "chains": {}, "speed": None, "left": None,
            "done": progress.evaluations, "total": total, "tried": None,
            "refined": _refinement_of([progress], progress.evaluations, total),
        }  # fmt: skip
        if display.design is not None:
            message |= display.message(display.design)
        with contextlib.suppress(OSError, BrokenPipeError):
            pipe.send(message)
        return not listener.stop.is_set()

    found = refine_file(design, RefinementSettings(evaluations=total), report)
    if listener.stop.is_set() and listener.command != "stop":
        return {"kind": "paused"}
    result = found.design
    (where / "run").mkdir(exist_ok=True)
    write_design(result, where / "run" / "design.json", overwrite=True)
    message = "" if found.improved else f"the design was not improved: {found.reason}"
    efficiency = None if result.efficiency is None else finite(result.efficiency)
    kind = "stopped" if listener.stop.is_set() else "finished"
    return {"kind": kind, "efficiency": efficiency, "message": message}


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
