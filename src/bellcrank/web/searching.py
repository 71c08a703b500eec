"""A search in a process of its own: told what to do, and telling how it goes.

Talks over a pipe. It is told ``pause`` (keep what is done, and end), ``stop`` (also choose a
design from it) and tells dictionaries with ``kind``: ``progress``, and at the end ``paused``,
``stopped``, ``finished`` or ``failed``. If the server dies, the pipe closes and it pauses.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from bellcrank.errors import BellcrankError, InvalidSettings, first_line
from bellcrank.storage.locking import locked

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from bellcrank.search import Progress, SearchSettings
    from bellcrank.storage import RunFolder
    from bellcrank.web.tracing import Point

TOO_EARLY = "nothing has been found yet that could be built; search a little longer"
INTERVAL = 0.1
"""Seconds between two messages."""
MOVED_INTERVAL = 0.4
"""Seconds between two responses of the design that is shown."""
NICENESS = 5


class Ears:
    """Listens to the pipe from a thread.

    Attributes
    ----------
    stop
        Set when the search is to end.
    told
        The last word.
    """

    def __init__(self, pipe: Connection) -> None:
        self.stop = threading.Event()
        self.told = "pause"
        self._pipe = pipe
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        while True:
            try:
                self.told = self._pipe.recv()
            except (EOFError, OSError):
                self.told = "pause"
                self.stop.set()
                return
            self.stop.set()


class Reporter:
    """Collects what the chains tell from their threads, and passes it on ten times a second."""

    def __init__(self, pipe: Connection, folder: RunFolder, settings: SearchSettings) -> None:
        from bellcrank.mechanics import SpringEvaluator

        self._pipe = pipe
        self._problem = folder.problem
        self._evaluator = SpringEvaluator(folder.problem)
        self._total = settings.chains * settings.steps
        self._lock = threading.Lock()
        self._chains: dict[int, dict[str, Any]] = {}
        self._points: dict[int, list[Point]] = {}
        self._made = 0
        self._start = time.monotonic()
        self._moved_at, self._moved_mask = 0.0, ""
        self._tried: tuple[int, int] | None = None
        self._done = {chain: folder.progress(chain)[0] for chain in range(settings.chains)}
        self._points.update(self._beginnings(settings))
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._pass_on, daemon=True)

    def _beginnings(self, settings: SearchSettings) -> dict[int, list[Point]]:
        """Return where chains that have done nothing yet stand: annealing is soon over."""
        from bellcrank.web.tracing import tidy

        efficiency = tidy(self._evaluator.evaluate(self._problem.initial).efficiency)
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
        """Take in the news of one chain."""
        from bellcrank.web.tracing import tidy

        state = progress.state
        now, best = tidy(state.efficiency), tidy(state.best)
        with self._lock:
            self._made += progress.steps
            self._done[progress.chain] = state.step
            self._chains[progress.chain] = {
                "step": state.step,
                "efficiency": now,
                "best": best,
                "temperature": progress.temperature,
                "accepted": state.accepted,
                "mask": _at_hand(state),
                "kept": _kept(state),
            }
            point = (state.step, now, best, round(progress.temperature, 6))
            self._points.setdefault(progress.chain, []).append(point)

    def trying(self, done: int, total: int) -> None:
        """Take in how many of the best designs have been tried as parts, and of how many."""
        with self._lock:
            self._tried = done, total

    def _pass_on(self) -> None:
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
            chains = {chain: dict(state) for chain, state in self._chains.items()}
            done, made, tried = sum(self._done.values()), self._made, self._tried
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
        }
        best = max(chains.values(), key=lambda each: _number(each["best"]))
        if time.monotonic() - self._moved_at > MOVED_INTERVAL and best["kept"] != self._moved_mask:
            message["moved"] = self._move(best["kept"])
        self._pipe.send(message)

    def _move(self, mask: str) -> dict[str, Any]:
        """Return the response of the design that is shown."""
        from bellcrank.model import unpack_mask
        from bellcrank.web.solving import finite, flat

        bits = unpack_mask(mask, self._problem.lattice.beam_count)
        response = self._evaluator.evaluate(bits)
        self._moved_at, self._moved_mask = time.monotonic(), mask
        shown = response.is_admissible
        return {
            "mask": mask,
            "efficiency": finite(response.efficiency),
            "displacement": flat(response.displacement) if shown else None,
        }


def _number(value: float | None) -> float:
    return float("-inf") if value is None else value


def _at_hand(state: Any) -> str:
    """Return the design that a chain has just been at: while a climb lasts, the climber's."""
    for name in ("climbing", "walker"):
        if getattr(state, name, None):
            return str(getattr(state, name))
    return _kept(state)


def _kept(state: Any) -> str:
    """Return the best design of a chain where it knows it, or else where it stands."""
    return str(state.mask if isinstance(state.mask, str) else state.mask[-1])


def run_search(where: str, workers: int, pipe: Connection) -> None:
    """Begin or go on with the search of a job, until it ends or is told to.

    Parameters
    ----------
    where
        Folder of the job (see `bellcrank.web.jobs`).
    workers
        Chains at the same time.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    ears = Ears(pipe)
    try:
        with locked(Path(where) / "lock"):  # one that has outlived its server may still work there
            outcome = _search(Path(where), workers, pipe, ears)
    except BellcrankError as error:
        outcome = {"kind": "failed", "message": first_line(error)}
    except (Exception, KeyboardInterrupt) as error:  # or nobody would hear of it
        outcome = {"kind": "failed", "message": f"{type(error).__name__}: {first_line(error)}"}
    with contextlib.suppress(OSError, BrokenPipeError):
        pipe.send(outcome)
        pipe.close()


def _search(where: Path, workers: int, pipe: Connection, ears: Ears) -> dict[str, Any]:
    from bellcrank.search import read_settings
    from bellcrank.workflows import complete_design
    from bellcrank.workflows.design import conclude

    folder = _begin_or_reopen(where)
    settings = read_settings(folder.settings)
    with Reporter(pipe, folder, settings) as reporter:
        report = complete_design(
            folder, workers=workers, tell=reporter, trying=reporter.trying, stop=ears.stop
        )
        if report is None and ears.told == "stop":
            try:
                report = conclude(folder, settings, reporter.trying)
            except InvalidSettings:
                return {"kind": "paused", "message": TOO_EARLY}
            return {"kind": "stopped", "efficiency": report.selection.efficiency_after}
    if report is None:
        return {"kind": "paused"}
    return {"kind": "finished", "efficiency": report.selection.efficiency_after}


def _begin_or_reopen(where: Path) -> RunFolder:
    from bellcrank.model import read_problem
    from bellcrank.part import PartSpec
    from bellcrank.search import read_settings
    from bellcrank.workflows import reopen_design, start_design

    run = where / "run"
    if (run / "run.json").exists():
        return reopen_design(run)
    asked = json.loads((where / "job.json").read_text(encoding="utf-8"))
    part = PartSpec.from_dict(asked["part"]) if asked["part"] is not None else None
    settings = read_settings(asked["settings"])
    return start_design(read_problem(where / "problem.json"), settings, run, part)
