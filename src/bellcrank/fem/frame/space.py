"""Analysis of a part in space as a frame, by the beams of searches with several elements each."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.contact import find_contacts
from bellcrank.fem.path import PathStatus
from bellcrank.fem.results import Analysis, Field, StrokePoint, stroke_point
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator, Status
from bellcrank.mechanics.frames.analysis import (
    centre_lines,
    deformations,
    fibre_stress,
    strain_of_frame,
    stress_resultants,
)
from bellcrank.mechanics.frames.quantities import quantities
from bellcrank.mechanics.stroke import STATES
from bellcrank.model import Elasticity

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.fem.contact import Contacts
    from bellcrank.fem.levels import FemSettings
    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.model import Problem
    from bellcrank.part.part import Part

STATUSES = {
    Status.CONVERGED: PathStatus.CONVERGED,
    Status.SNAPPED: PathStatus.SNAPPED,
    Status.MECHANISM: PathStatus.MECHANISM,
}
"""How a path ends, by the status of the response; all others are not converged."""


def check_in_space(settings: FemSettings) -> None:
    """Raise InvalidSettings if a part in space cannot be analysed with these settings."""
    if settings.linear:
        raise InvalidSettings(
            "level 'frame': parts in space are analysed with large displacements; leave out "
            "--linear"
        )


def problem_of_part(part: Part) -> Problem:
    """Return the problem of a part with the section and the material of the part.

    Lengths are in lattice units and forces in units of `Part.stiffness_unit` times `Part.scale`.
    """
    problem = part.design.problem
    section = part.section.scaled(1.0 / part.scale)
    young = part.material.young * part.scale / part.stiffness_unit
    widths = problem.widths
    if widths is not None and problem.section is not None:
        widths = widths * (section.width / problem.section.width)
    material = Elasticity(young, part.material.poisson)
    return replace(problem, section=section, material=material, widths=widths)


def analyse_in_space(
    part: Part, settings: FemSettings, report: Callable[[float], None]
) -> Analysis:
    """Analyse a part in space as a frame.

    Parameters
    ----------
    part
        Part to be analysed.
    settings
        Beam theory and elements of each strut.
    report
        Called with the load reached.
    """
    began = time.perf_counter()
    problem = problem_of_part(part)
    evaluator = FrameEvaluator(problem, elements=settings.elements, theory=settings.theory)
    response = evaluator.evaluate(part.design.mask, VERIFICATION_INCREMENT)
    reached = response.reached
    fractions = [k / STATES * reached for k in range(1, STATES + 1)]
    found = [each for each in map(evaluator.equilibrium, fractions) if each is not None]
    report(reached if found else 0.0)
    states = _States(part, problem, evaluator)
    return Analysis(
        part=part,
        level="frame",
        theory=settings.theory,
        linear=False,
        status=STATUSES.get(Status(response.status), PathStatus.UNCONVERGED),
        loss=None,
        points=[states.point(each) for each in found] or [states.rest()],
        contacts=states.contacts(found),
        field=states.field(found[-1] if found else None),
        cost={
            "seconds": time.perf_counter() - began,
            "unknowns": states.unknowns,
        },
    )


class _States:
    """Figures of the equilibria of a part, in N and mm."""

    def __init__(self, part: Part, problem: Problem, evaluator: FrameEvaluator) -> None:
        self.part, self.problem, self.evaluator = part, problem, evaluator
        self.force = part.stiffness_unit * part.scale
        self.elements = np.arange(len(evaluator.frame.beams))

    @property
    def unknowns(self) -> int:
        """Number of displacements and rotations that are not held."""
        active = self.evaluator.structure.active.astype(bool)
        return int(np.count_nonzero(self.evaluator.frame.held[active] == 0))

    def rest(self) -> StrokePoint:
        """Return the figures at rest."""
        motion = np.zeros_like(self.problem.lattice.positions)
        forces = np.zeros_like(self.problem.input.direction)
        return stroke_point(self.part, 0.0, motion, forces, 0.0, energy=0.0, stress=0.0, strain=0.0)

    def point(self, state: Equilibrium) -> StrokePoint:
        """Return the figures of an equilibrium."""
        strain = strain_of_frame(self.evaluator, state)
        nodes = self.problem.lattice.node_count
        return stroke_point(
            self.part,
            state.fraction,
            self.part.scale * state.state.u[:nodes, :3],
            self.force * strain.input_forces,
            quantities["rotation"].value(state),
            energy=self.force * self.part.scale * float(strain.energy.sum()),
            stress=float(self._stress(state).max()),
            strain=quantities["strain"].value(state),
        )

    def contacts(self, states: Sequence[Equilibrium]) -> Contacts:
        """Return the struts that touch in any of some equilibria."""
        scale, evaluator = self.part.scale, self.evaluator
        rest, _ = centre_lines(evaluator, evaluator.state)
        stroke = (
            (each.fraction, scale * centre_lines(evaluator, each.state)[1]) for each in states
        )
        return find_contacts(evaluator.beams, scale * rest, stroke, self.part.widths)

    def field(self, state: Equilibrium | None) -> Field:
        """Return a state for pictures and files; that of rest for None."""
        frame, scale = self.evaluator.frame, self.part.scale
        nodes, cells = np.unique(frame.beams, return_inverse=True)
        moved, stress = np.zeros((len(nodes), 3)), np.zeros(len(frame.beams))
        if state is not None:
            moved, stress = state.state.u[nodes, :3], self._stress(state)
        return Field(scale * frame.positions[nodes], scale * moved, cells.reshape(-1, 2), stress)

    def _stress(self, state: Equilibrium) -> NDArray[np.float64]:
        """Return (e,) the largest von Mises stress of each element, MPa."""
        frame = self.evaluator.frame
        deformed = deformations(frame, self.elements, *state.ends(self.elements))
        resultants = stress_resultants(frame, self.elements, deformed)
        stress = fibre_stress(frame, self.problem, self.elements, resultants)
        return self.force / self.part.scale**2 * stress
