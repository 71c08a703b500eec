"""Items of a specification in the sheet: the outline in plane stress; in space in the solid."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.continuum.analysis import contacts_along
from bellcrank.fem.continuum.equations import ContinuumEquations
from bellcrank.fem.continuum.fields import stress_field
from bellcrank.fem.continuum.mesh import COARSE, FINE, plane_mesh
from bellcrank.fem.continuum.response import complete_state, hub_displacements, output_rotation
from bellcrank.fem.continuum.space_mesh import space_mesh
from bellcrank.fem.continuum.system import continuum_system
from bellcrank.fem.path import PathState, PathStatus, StepControl, follow_path
from bellcrank.mechanics import Channel, StrokeRecord, channels_of, item_results
from bellcrank.mechanics.frames.output_loads import (
    with_dead_load,
    with_held_output,
    with_output,
    with_payload,
)
from bellcrank.mechanics.output import motion_weights
from bellcrank.mechanics.splines import stroke_spline
from bellcrank.mechanics.stroke_record import forces_of
from bellcrank.search.strut_loss import StrutLosses

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    from bellcrank.fem.continuum.mesh import ContinuumMesh, Fineness
    from bellcrank.fem.continuum.response import ContinuumState
    from bellcrank.fem.path import EquilibriumPath
    from bellcrank.fem.results import Field
    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Item, ObjectiveTerm, Problem, Specification
    from bellcrank.part import Part

    Values = NDArray[np.float64]

STEPS = StepControl(first=0.125)
ROUGH_STEPS = StepControl(first=0.125, smallest=1e-2, factorisations=100)
"""For coarse meshes: paths that need smaller or more steps count as unstable; most need 40 to 60
factorisations."""
STATES = 16
"""Number of states along the stroke at which items are evaluated; between the computed ones,
channels are interpolated by a cubic spline in each part of the stroke without a kink."""
LAW = "neo-hookean"
OWN_PATHS = ("loaded_motion", "carried_motion", "blocked_force")
"""Channels that need a path of their own."""
DIGITS = 10
"""Number of digits of the channels. NGSolve adds in an order that differs from run to run; later
digits would make refinements with equal seeds differ."""


@dataclass(frozen=True, slots=True, eq=False)
class SheetPath:
    """Path of a part in one load case."""

    part: Part
    equations: ContinuumEquations
    path: EquilibriumPath
    states: list[ContinuumState]
    fields: list[Field]

    @property
    def loads(self) -> Values:
        """(S,) fractions of the stroke of the states, from 0 on."""
        return np.array([state.load for state in self.states])

    @property
    def motion(self) -> Values:
        """(S, N, d) mean displacements of the hubs of lattice nodes, lattice units."""
        return np.stack([state.motion for state in self.states]) / self.part.scale


def sheet_items(
    part: Part,
    size: float | None = None,
    report: Callable[[str, float], None] = lambda _case, _load: None,
    fineness: Fineness = FINE,
) -> list[ItemResult] | None:
    """Return the items of the specification of a part in the sheet.

    Parameters, return value and errors are those of `sheet_records`.
    """
    wanted = part.design.problem.specification
    assert wanted is not None
    records = sheet_records(part, size, report, fineness)
    return None if records is None else item_results(wanted.items, records)


def sheet_records(
    part: Part,
    size: float | None = None,
    report: Callable[[str, float], None] = lambda _case, _load: None,
    fineness: Fineness = FINE,
    mesh: ContinuumMesh | None = None,
    quantities: Sequence[str] = (),
) -> dict[str, StrokeRecord] | None:
    """Return the channels of the items and objectives of a part in the sheet, by load case.

    The loss of struts is that by frames.

    Parameters
    ----------
    part
        Part whose problem has a specification.
    size
        Largest edge of the triangles, mm; that of `fineness` by default.
    report
        Called with the name of the load case and the fraction of its paths that is computed.
    fineness
        How fine the mesh in the plane is. With `COARSE`, a path that needs steps below a
        hundredth of the stroke, or more than a hundred factorisations, counts as unstable.
    mesh
        Mesh of another outline with the same ports; that of the struts by default. The part then
        gives the problem and the material only, and a bound on the clearance of its struts has no
        meaning.
    quantities
        Names of quantities that are recorded for each output besides items and objectives. In space
        the channel ``rotation_vector`` is then recorded beside each rotation, degrees.

    Returns
    -------
    dict of StrokeRecord, or None
        None if the part is not stable along the whole stroke in every load case.

    Raises
    ------
    InvalidSettings
        If NGSolve is not installed, or the part cannot be meshed.
    """
    wanted = part.design.problem.specification
    assert wanted is not None
    if mesh is None:
        in_plane = part.dimension == 2
        mesh = plane_mesh(part, size, fineness) if in_plane else space_mesh(part, size)
    records = {}
    control = ROUGH_STEPS if fineness is COARSE else STEPS
    for name in part.design.problem.cases:
        sheet = _Sheet(part, mesh, name, wanted, control)
        record = sheet.record(partial(report, name), quantities)
        if record is None:
            return None
        records[name] = record
    if any(item.quantity == "strut_loss" for item in wanted.items):
        # By frames: a mesh without each strut would take hours.
        loss = StrutLosses(part.design.problem).largest(part.design.mask)
        for name, record in records.items():
            records[name] = replace(record, given={**record.given, "strut_loss": loss})
    return records


def path_count(problem: Problem, case: str) -> int:
    """Return the number of paths to the full stroke that the items of a load case need.

    Parameters
    ----------
    problem
        Problem with a specification.
    case
        Name of the load case.
    """
    wanted = problem.specification
    assert wanted is not None
    terms: list[Item | ObjectiveTerm] = [*wanted.items, *wanted.maximise]
    own = [each for each in terms if each.case == case]
    needed = {channel for each in own for channel in channels_of(each.quantity, each.output)}
    return _path_count(needed)


def _path_count(channels: Iterable[Channel]) -> int:
    """Return the number of paths that channels need: one for all, and those of their own."""
    return 1 + sum(channel.name in OWN_PATHS for channel in channels)


class _Sheet:
    """Channels of one load case in the sheet."""

    def __init__(
        self,
        part: Part,
        mesh: ContinuumMesh,
        name: str,
        wanted: Specification,
        control: StepControl,
    ) -> None:
        self.part, self.mesh, self.control = part, mesh, control
        self.case = part.design.problem.cases[name]
        self.items = [item for item in wanted.items if item.case == name]
        self.objectives = [each for each in wanted.maximise if each.case == name]
        self.forces = forces_of(self.items)
        self.weight = wanted.weight
        self.report: Callable[[float], None] = lambda _load: None
        self.force_unit = part.stiffness_unit * part.scale

    def record(
        self, report: Callable[[float], None], quantities: Sequence[str] = ()
    ) -> StrokeRecord | None:
        """Return the channels that items, objectives and further quantities of all outputs need.

        None without a stable path.
        """
        items: list[Item | ObjectiveTerm] = [*self.items, *self.objectives]
        wanted = [(each.quantity, each.output) for each in items]
        wanted += [(quantity, output) for output in self.case.outputs for quantity in quantities]
        needed = dict.fromkeys(channel for each in wanted for channel in channels_of(*each))
        turned = [channel.output for channel in needed if channel.name == "rotation"]
        if quantities and self.part.dimension == 3:
            needed |= dict.fromkeys(Channel("rotation_vector", output) for output in turned)
        paths = _path_count(needed)

        def share(done: int, load: float) -> None:
            report((done + load) / paths)

        self.report = partial(share, 0)
        main = self._path()
        if main is None:
            return None
        ends = [end for item in self.items for end in (item.start, item.stop) if end > 0.0]
        kinks = self.case.kinks
        fractions = np.unique(np.concatenate([np.arange(1, STATES + 1) / STATES, ends, kinks]))
        channels, done = {}, 1
        for channel in needed:
            self.report = partial(share, done)
            channels[channel] = self._channel(channel, main, fractions)
            done += channel.name in OWN_PATHS
        self.report = lambda _load: None
        channels = {channel: _rounded(values) for channel, values in channels.items()}
        return StrokeRecord(fractions, channels, self._given(main), self.forces, kinks)

    def _part(self, problem: Problem) -> Part:
        return replace(self.part, design=replace(self.part.design, problem=problem))

    def _follow(self, problem: Problem) -> tuple[ContinuumEquations, EquilibriumPath] | None:
        """Follow a load case to the full stroke; None if stability is lost before."""
        system = continuum_system(self._part(problem), self.mesh, LAW)
        equations = ContinuumEquations(system)
        path = follow_path(equations, self.control, lambda state: self.report(state.load))
        return (equations, path) if path.status is PathStatus.CONVERGED else None

    def _path(self) -> SheetPath | None:
        """Follow the load case, with all figures of its states; None if stability is lost."""
        found = self._follow(self.case)
        if found is None:
            return None
        equations, path = found
        part = self._part(self.case)
        stresses = [stress_field(equations, state.unknowns) for state in path.states]
        states = [
            complete_state(part, equations, state, stress)
            for state, stress in zip(path.states, stresses, strict=True)
        ]
        return SheetPath(part, equations, path, states, [each.field for each in stresses])

    def _last_motion(self, problem: Problem) -> Values | None:
        """Return (N, d) the displacements at full stroke, lattice units; None without stability."""
        found = self._follow(problem)
        if found is None:
            return None
        equations, path = found
        return self._hub_motion(equations, path.states[-1].unknowns) / self.part.scale

    def _channel(self, channel: Channel, main: SheetPath, fractions: Values) -> Values:
        """Return a channel at fractions of the stroke, or the one value that it has."""
        problem = with_output(self.case, channel.output) if channel.output else self.case
        single: dict[str, Callable[[SheetPath, Problem], Values]] = {
            "stiffness": self._stiffness, "sag": self._sag, "loaded_motion": self._loaded,
            "carried_motion": self._carried, "blocked_force": self._blocked,
        }  # fmt: skip
        if channel.name in single:
            return single[channel.name](main, problem)
        values = self._along(channel, main, problem)
        return stroke_spline(main.loads, values, self.case.kinks, fractions)

    def _along(self, channel: Channel, main: SheetPath, problem: Problem) -> Values:
        """Return (S,) or (S, c) a channel at the states of a path."""
        name = channel.name
        if name == "motion":
            return self._means(main.motion, problem)
        if name in {"rotation", "rotation_vector"}:
            found = self._rotations(main, problem)
            is_size = name == "rotation" and found.ndim == 2
            return np.asarray(np.linalg.norm(found, axis=1)) if is_size else found
        if name == "displacement":
            return np.asarray(main.motion[:, problem.output.nodes].mean(axis=1))
        if name == "input_motion":
            return self._input_motion(main)
        if name == "input_force":
            return np.array([state.input_force / self.force_unit for state in main.states])
        assert name == "strain"
        return np.array([state.strain for state in main.states])

    def _means(self, motion: Values, problem: Problem) -> Values:
        moved = motion[:, problem.output.nodes]
        return np.asarray(np.einsum("kna,sna->sk", motion_weights(problem), moved))

    def _input_motion(self, main: SheetPath) -> Values:
        given = self.case.input
        return np.asarray((main.motion[:, given.nodes] * given.direction).sum(axis=2).mean(axis=1))

    def _rotations(self, main: SheetPath, problem: Problem) -> Values:
        """Return (S,) the rotation of the output, degrees; in space (S, 3) its vector."""
        turns = [
            output_rotation(problem, self.mesh, motion, field)
            for motion, field in zip(main.motion, main.fields, strict=True)
        ]
        return np.array(turns, dtype=np.float64)

    def _stiffness(self, main: SheetPath, problem: Problem) -> Values:
        """Return (1,) the stiffness of the output at full stroke, lattice units."""
        output = problem.output
        force = output.direction / len(output.nodes)
        unknowns = main.path.states[-1].unknowns
        motion = main.equations.motion_by_forces(unknowns, output.nodes, force)
        moved = self._hub_motion(main.equations, motion)[output.nodes]
        compliance = float((moved * output.direction).sum(axis=1).mean())
        stiffness = 1.0 / compliance if compliance > 0.0 else 0.0
        return np.array([stiffness / self.part.stiffness_unit])

    def _sag(self, main: SheetPath, problem: Problem) -> Values:
        """Return (1,) the motion of the output by the own weight at rest, lattice units."""
        assert self.weight is not None
        weight = self.force_unit / self.part.scale**3 * self.weight
        moved = self._hub_motion(main.equations, main.equations.motion_by_weight(weight))
        size = float(np.linalg.norm(moved[problem.output.nodes].mean(axis=0)))
        return np.array([size / self.part.scale])

    def _hub_motion(self, equations: ContinuumEquations, unknowns: Values) -> Values:
        """Return (N, d) the mean displacements of hubs, mm."""
        return hub_displacements(equations, PathState(1.0, unknowns))

    def _loaded(self, _main: SheetPath, problem: Problem) -> Values:
        """Return (1, 1 + d) the motion of the output under a force that grows with the input."""
        force = self.forces[Channel("loaded_motion", next(iter(problem.outputs)))]
        return self._means_of(self._last_motion(with_payload(problem, force)), problem)

    def _carried(self, _main: SheetPath, problem: Problem) -> Values:
        """Return (1, 1 + d) the motion of the output under a force that acts before the input."""
        force = self.forces[Channel("carried_motion", next(iter(problem.outputs)))]
        return self._means_of(self._last_motion(with_dead_load(problem, force)), problem)

    def _means_of(self, motion: Values | None, problem: Problem) -> Values:
        if motion is None:
            return np.full((1, 1 + problem.lattice.dimension), np.nan)
        return self._means(motion[None], problem)

    def _blocked(self, _main: SheetPath, problem: Problem) -> Values:
        """Return (1,) the force of the output on springs that hold it, lattice units."""
        held = with_held_output(problem)
        motion = self._last_motion(held)
        if motion is None:
            return np.full(1, np.nan)
        assert held.output.spring is not None
        moved = motion[held.output.nodes]
        return np.array([held.output.spring * float((moved * held.output.direction).sum())])

    def _given(self, main: SheetPath) -> dict[str, float]:
        """Return the quantities that do not follow from channels."""
        wanted = {item.quantity: item.at_least or 0.0 for item in self.items}
        problem = self.part.design.problem
        assert problem.section is not None
        mask, length = self.part.design.mask, problem.lattice.rest_length
        area = problem.section.area_of(problem.beam_widths)
        given = {"mass": float((area * length)[mask].sum())}
        if "clearance" in wanted:
            given["clearance"] = self._gap(main, wanted["clearance"])
        if "stable_stroke" in wanted:
            bound = wanted["stable_stroke"]
            extended = replace(self.case.input, amount=bound * self.case.input.amount)
            stable = self._follow(replace(self.case, input=extended)) is not None
            given["stable_stroke"] = bound if stable else 1.0
        return given

    def _gap(self, main: SheetPath, bound: float) -> float:
        """Return the smallest gap between struts; infinite above the bound. Lattice units."""
        part = self.part
        least = part.widths + bound * part.scale
        overlap = contacts_along(part, main.states, main.fields, least).overlap
        return bound - float(overlap.max()) / part.scale if len(overlap) else math.inf


def _rounded(values: Values) -> Values:
    """Return a channel, rounded to `DIGITS` digits of its largest value."""
    largest = float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
    if largest == 0.0:
        return values
    return np.round(values, DIGITS - math.ceil(math.log10(largest)))
