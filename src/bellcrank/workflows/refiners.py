"""Refinement of several designs at a time, each in a process."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.mesh import COARSE
from bellcrank.fem.specification import sheet_records
from bellcrank.mechanics import VERIFICATION_INCREMENT
from bellcrank.processes import FunctionProcess
from bellcrank.refine import Refinement, RefinementSettings, refine_design
from bellcrank.refine.differences import on_same_path
from bellcrank.search import SpecificationEvaluator
from bellcrank.search.parallel import POLL_INTERVAL
from bellcrank.search.verification import ELEMENTS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bellcrank.model import Design, Problem
    from bellcrank.part import PartSpec
    from bellcrank.refine.differences import Records
    from bellcrank.refine.refinement import Progress

    Report = Callable[[int, Progress], None]

FIRST_EVALUATIONS = 100
"""Number of geometries that the refinement of each design of a search evaluates."""
EVALUATIONS = 500
"""Number of further ones for the best designs."""
SETTINGS = RefinementSettings(evaluations=EVALUATIONS)
JOINTS = (0.5, 1.5)
"""Lengths of the joints of a part in space, over those of its section, for which it is computed
again: in the solid each joint has another length."""
DISPLACED = 0.1
"""Root mean square distance by which its nodes are displaced then, mm. Parts with a symmetry may
lose it where they are soft, which no symmetric model shows."""
DEPARTURE = 0.2
"""Largest difference of the motions of two such parts, over the motion."""


def refine_designs(
    designs: Sequence[Design],
    spec: PartSpec | None,
    report: Report,
    workers: int,
    stop: threading.Event,
    settings: RefinementSettings | None = None,
) -> list[Refinement]:
    """Refine designs and return the results in their order.

    Parameters
    ----------
    designs
        Designs of frames with a specification.
    spec
        Part that is computed in the sheet; None for no sheet.
    report
        Called with the number of a design and each accepted step, from threads of their own.
    workers
        Number of designs at a time. Several are refined in processes.
    stop
        Event that stops all; there are fewer results then.
    settings
        Settings of each refinement; `SETTINGS` by default.
    """
    settings = settings or SETTINGS
    workers = min(workers, len(designs))
    if workers > 1:
        return _Refiners(designs, spec, settings, report).run(workers, stop)
    results: list[Refinement] = []
    for number, design in enumerate(designs):

        def step(progress: Progress, number: int = number) -> bool:
            report(number, progress)
            return not stop.is_set()

        found = refine_design(design, settings, step, sheet=sheet_of(spec, design))
        if stop.is_set():
            break
        results.append(found)
    return results


class _Refiners:
    """Refinements in processes, each followed by a thread."""

    def __init__(
        self,
        designs: Sequence[Design],
        spec: PartSpec | None,
        settings: RefinementSettings,
        report: Report,
    ) -> None:
        self.designs, self.report = designs, report
        self.options = (spec, settings)
        self.results: dict[int, Refinement] = {}
        self.errors: list[BaseException] = []
        self.waiting = deque(range(len(designs)))
        self.running: list[FunctionProcess] = []
        self.lock = threading.Lock()
        self.stopped = False

    def run(self, workers: int, stop: threading.Event) -> list[Refinement]:
        """Return the results in the order of the designs; fewer if they were stopped."""
        threads = [threading.Thread(target=self._work, daemon=True) for _ in range(workers)]
        for thread in threads:
            thread.start()
        try:
            for thread in threads:
                while thread.is_alive() and not stop.is_set():
                    thread.join(POLL_INTERVAL)
        finally:
            self._stop()
        if self.errors:
            raise self.errors[0]
        return [self.results[number] for number in sorted(self.results)]

    def _work(self) -> None:
        while True:
            with self.lock:
                if self.stopped or not self.waiting:
                    return
                number = self.waiting.popleft()
                process = FunctionProcess(
                    __name__, send_refinement.__name__, self.designs[number], *self.options
                )
                self.running.append(process)
            try:
                for value in process:
                    if isinstance(value, Refinement):
                        self.results[number] = value
                    else:
                        self.report(number, value)
            except BaseException as error:  # raised again by `run`
                if not self.stopped:
                    self.errors.append(error)
                self._stop()
                return

    def _stop(self) -> None:
        with self.lock:
            self.stopped = True
            for process in self.running:
                process.kill()


def send_refinement(
    send: Callable[[object], None],
    design: Design,
    spec: PartSpec | None,
    settings: RefinementSettings,
) -> None:
    """Refine a design; send each accepted step without derivatives, then the result."""

    def report(progress: Progress) -> bool:
        none = np.zeros((0, 0))
        rows = replace(progress.rows, objective_slopes=none, constraint_slopes=none)
        send(replace(progress, rows=rows))
        return True

    send(refine_design(design, settings, report, sheet=sheet_of(spec, design)))


def sheet_of(spec: PartSpec | None, design: Design) -> Callable[[Design], Records | None] | None:
    """Return a function from a design to its channels in the sheet; None without NGSolve.

    In space, where the solid takes minutes, to its channels with imperfections.
    """
    if spec is None:
        return None
    if design.problem.lattice.dimension == 3:
        return partial(with_imperfections, displaced=DISPLACED / spec.scale)
    if find_spec("ngsolve") is None:
        return None

    def records(design: Design) -> Records | None:
        try:
            return sheet_records(spec.of(design), fineness=COARSE)
        except InvalidSettings:  # no outline: struts almost touch
            return None

    return records


def with_imperfections(design: Design, displaced: float) -> Records | None:
    """Return the channels of a part in space with shorter joints and displaced nodes.

    Parameters
    ----------
    displaced
        Root mean square distance of the nodes from their places, lattice units.

    Returns
    -------
    dict of StrokeRecord, or None
        None if a path is not stable with shorter or longer joints, or the motions differ too much.
    """
    section, wanted = design.problem.section, design.problem.specification
    assert section is not None
    assert wanted is not None
    wanted = replace(wanted, symmetry=())
    positions, rng = design.problem.lattice.positions, np.random.default_rng(0)
    found = []
    for factor in JOINTS:
        moved = positions + displaced / np.sqrt(3.0) * rng.standard_normal(positions.shape)
        problem = replace(
            design.problem.with_geometry(moved, design.problem.beam_widths),
            section=replace(section, joint=min(factor * section.joint, 0.5 * section.width)),
            specification=wanted,
        )
        evaluator = SpecificationEvaluator(problem, elements=ELEMENTS)
        if not evaluator.evaluate(design.mask, VERIFICATION_INCREMENT).is_admissible:
            return None
        found.append(evaluator.records)
    return found[0] if on_same_path(found[0], found[1], DEPARTURE) else None


def second_model(problem: Problem) -> str:
    """Return what a refinement is verified in besides frames with eight elements."""
    return "sheet" if problem.lattice.dimension == 2 else "imperfections"
