"""Refinement of several designs at a time, each in a process."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.mesh import COARSE
from bellcrank.fem.specification import sheet_records
from bellcrank.mechanics import VERIFICATION_INCREMENT
from bellcrank.processes import FunctionProcesses
from bellcrank.refine import Refinement, RefinementSettings, refine_design
from bellcrank.refine.differences import on_same_path
from bellcrank.search import SpecificationEvaluator
from bellcrank.search.choice import STARTS
from bellcrank.search.verification import ELEMENTS

if TYPE_CHECKING:
    import threading
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
KEPT_EVALUATIONS = 1500
"""The same where deviations are to keep a part of the efficiency."""
JOINTS = (0.5, 1.5)
"""Lengths of the joints of a part in space, over those of its section, for which it is computed
again: in the solid each joint has another length."""
DISPLACED = 0.1
"""Root mean square distance by which its nodes are displaced then, mm. Parts with a symmetry may
lose it where they are soft, which no symmetric model shows."""
DEPARTURE = 0.2
"""Largest difference of the motions of two such parts, over the motion."""


class GeometryCount:
    """Number of geometries of the refinements of several designs.

    Parameters
    ----------
    chains
        Number of chains of the search that found them.
    problem
        Problem of the search; None for one without deviations that keep a part of the efficiency.
    most
        Largest number of geometries, if it is given.

    Examples
    --------
    >>> count = GeometryCount(chains=1)
    >>> for evaluations in (60, 100, 20):  # the third is that of a second refinement
    ...     count.add(0, evaluations)
    >>> count.done, count.most
    (120, 800)
    """

    def __init__(
        self, chains: int = 1, problem: Problem | None = None, most: int | None = None
    ) -> None:
        self._chains, self._most = chains, most
        self._further = further_settings(problem).evaluations
        self._latest: dict[int, int] = {}
        self._before = 0

    def add(self, number: int, evaluations: int) -> None:
        """Record the number of geometries of the refinement of a design."""
        last = self._latest.get(number, 0)
        if evaluations < last:
            self._before += last
        self._latest[number] = evaluations

    @property
    def done(self) -> int:
        """Number of geometries so far."""
        return self._before + sum(self._latest.values())

    @property
    def most(self) -> int:
        """Largest number; in a search the usual one, beyond which a better model may lead."""
        if self._most is not None:
            return self._most
        first = max(len(self._latest), STARTS * self._chains)
        return FIRST_EVALUATIONS * first + self._further * self._chains


def further_settings(problem: Problem | None) -> RefinementSettings:
    """Return the settings of the refinement of the best designs of a search."""
    wanted = None if problem is None else problem.specification
    tolerances = None if wanted is None else wanted.tolerances
    is_kept = tolerances is not None and tolerances.keep > 0.0
    return replace(SETTINGS, evaluations=KEPT_EVALUATIONS) if is_kept else SETTINGS


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
        Designs of frames.
    spec
        Part that is computed in the sheet, whose material bounds the strain of a problem without a
        specification; None for no sheet.
    report
        Called with the number of a design and each accepted step, from threads of their own.
    workers
        Number of designs, and of processes, at a time.
    stop
        Event that ends all processes at once; there are fewer results then.
    settings
        Settings of each refinement; those of the designs that a search refines further by default.
    """
    if settings is None:
        settings = further_settings(designs[0].problem)
    refined: dict[int, Refinement] = {}

    def receive(number: int, value: Refinement | Progress) -> None:
        if isinstance(value, Refinement):
            refined[number] = value
        else:
            report(number, value)

    jobs = [(design, spec, settings) for design in designs]
    processes = FunctionProcesses(__name__, send_refinement.__name__, jobs, receive)
    processes.run(min(workers, len(designs)), stop)
    return [refined[number] for number in sorted(refined)]


def send_refinement(
    send: Callable[[object], None],
    design: Design,
    spec: PartSpec | None,
    settings: RefinementSettings,
) -> None:
    """Refine a design; send each accepted step without derivatives, then the result."""

    def report(progress: Progress) -> None:
        none = np.zeros((0, 0))
        rows = replace(progress.rows, objective_slopes=none, constraint_slopes=none)
        send(replace(progress, rows=rows))

    limit = math.nan if spec is None else spec.registered_material.strain_limit
    send(refine_design(design, settings, report, limit, sheet_of(spec, design)))


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
