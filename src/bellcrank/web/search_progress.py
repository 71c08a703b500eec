"""Progress of a search, which its process sends to the server."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from typing import TYPE_CHECKING, Any, Self

from bellcrank.model import pack_mask, unpack_mask
from bellcrank.web.refinement_progress import MOVED_INTERVAL, RefinementReporter, displayed

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from bellcrank.model import Design
    from bellcrank.refine.refinement import Progress as RefinementProgress
    from bellcrank.search import Progress, SearchSettings
    from bellcrank.storage import RunFolder
    from bellcrank.web.curves import Point

INTERVAL = 0.1
"""Seconds between two messages."""


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
        self._refinements = RefinementReporter(
            self._part, GeometryCount(settings.chains, folder.problem)
        )
        self._total = settings.chains * settings.steps
        self._lock = threading.Lock()
        self._chains: dict[int, dict[str, Any]] = {}
        self._scores: dict[int, float] = {}
        self._points: dict[int, list[Point]] = {}
        self._made = 0
        self._start = time.monotonic()
        self._moved_at, self._moved_mask = 0.0, ""
        self._tried: tuple[int, int] | None = None
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
            self._refinements.only_met = (
                _met_score(max(self._scores.values(), default=-math.inf)) is not None
            )
            self._refinements.add(number, progress)

    def refined_designs(self) -> list[Design]:
        """Return the best design of each refinement, those that meet all items first."""
        with self._lock:
            return self._refinements.designs()

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
            scores = dict(self._scores)
            refined, shape = self._refinements.summary(), self._refinements.design
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
            "refined": refined,
        }
        best = chains[max(scores, key=scores.__getitem__)]
        if shape is not None:
            message |= self._refinements.message(shape)
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


def _met_score(value: float) -> float | None:
    """Return a score rounded for drawing; None for a design that misses items or constraints."""
    from bellcrank.search.scores import LEAST_MET
    from bellcrank.web.curves import rounded

    return rounded(value) if value > LEAST_MET else None


def _current_mask(state: Any) -> str:
    """Return the current design of a chain, during a local search that of the local search."""
    return str(getattr(state, "current", None) or _best_mask(state))


def _best_mask(state: Any) -> str:
    """Return the best design of a chain if its state has it, else the current one."""
    return str(state.mask if isinstance(state.mask, str) else state.mask[-1])
