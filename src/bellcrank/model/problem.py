"""Problems and designs."""

from __future__ import annotations

import hashlib
import json
from copy import deepcopy
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import boolean_mask, check_ids, id_list, locked, real_array, rebuild
from bellcrank.model.checks import (
    check_connection,
    check_coordinates,
    check_frame_only,
    check_joints,
    check_regions,
    check_section,
    check_slender,
    check_texts,
    check_widths,
)
from bellcrank.model.conditions import Aggregate, Input, Output, Stiffness, Supports
from bellcrank.model.loads import Loads
from bellcrank.model.masks import pack_mask
from bellcrank.model.plain_data import input_data, output_data, specification_data, supports_data
from bellcrank.model.section import DEFAULT_MATERIAL, Elasticity, Section
from bellcrank.model.specification import Case, Specification
from bellcrank.model.stroke_ranges import WHOLE, kinks_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.model.lattice import Lattice

PROBLEM_SCHEMA = "bellcrank/problem/1"


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """A lattice with supports, input, output and the beams to design.

    With a section the beams are those of a frame, in the plane or in space; without one they are
    the springs of the paper's model, in the plane.

    Parameters
    ----------
    name
        Name of the problem.
    lattice
        Nodes and all beams that may exist; planar, or in space if there is a section.
    supports, input, output
        Disjoint sets of nodes.
    stiffness
        Stiffness of beams and joints of the spring model.
    initial : (M,) bool
        Beams present in the initial design; all by default.
    designable : (D,) int64, beam indices
        Beams that a search may remove or add, sorted; by default those that touch no support,
        input or output node. All others remain as in `initial`.
    aggregate
        Whether an efficiency is a ratio of means over the nodes of a region (the paper) or of
        sums (the published code, for forces).
    objective
        Name of the objective; None for the default of the drive.
    section
        Cross-section of the beams of a frame, in lattice units; round in space. None for the
        spring model.
    material
        Material of the beams of a frame; by default Young's modulus is 1 and Poisson's ratio
        0.48.
    loads
        Forces, springs and own weight besides the input; only for frames.
    specification
        What a design must meet, with further outputs and load cases; only for frames.
    widths : (M,) float64, lattice units
        Width of each beam of a frame, in space its diameter; None for that of the section.
    joints : (M, 2) float64, lattice units
        Length of both ends of each beam that do not bend; None for those of the section, in
        proportion to the width.

    Raises
    ------
    InvalidProblem
        If regions overlap or name unknown nodes, no path of beams connects output and input,
        no beam is designable, directions or supports have other coordinates than the positions,
        positions in space have no round section, a material has no section, or a beam is not
        longer than wide.

    Examples
    --------
    A square of four beams, two of which are designable:

    >>> from bellcrank.model import Lattice
    >>> problem = Problem(
    ...     name="lever",
    ...     lattice=Lattice([[0, 0], [1, 0], [0, 1], [1, 1]], [[0, 1], [0, 2], [1, 3], [2, 3]]),
    ...     supports=Supports(fixed=[0]),
    ...     input=Input(nodes=[1], direction=[0, -1], drive="displacement", amount=0.1),
    ...     output=Output(nodes=[2], direction=[-1, 0]),
    ...     designable=[2, 3],
    ... )
    >>> problem.full_design().beam_count
    4

    The same as a frame:

    >>> frame = replace(problem, section=Section(width=0.2, thickness=0.5))
    >>> frame.material
    Elasticity(young=1.0, poisson=0.48)
    """

    name: str
    lattice: Lattice
    supports: Supports
    input: Input
    output: Output
    stiffness: Stiffness = Stiffness()  # noqa: RUF009 - frozen, so it is safe to share
    # The constructor replaces None by the default.
    initial: NDArray[np.bool_] = None  # type: ignore[assignment]
    designable: NDArray[np.int64] = None  # type: ignore[assignment]
    aggregate: Aggregate = "mean"
    objective: str | None = None
    section: Section | None = None
    material: Elasticity | None = None
    loads: Loads = Loads()  # noqa: RUF009 - frozen, so it is safe to share
    specification: Specification | None = None
    widths: NDArray[np.float64] | None = None
    joints: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        lattice, given = self.lattice, self.input
        check_texts(self.name, self.aggregate, self.objective)
        check_section(lattice, self.section, self.material)
        outputs, loads = list(self.outputs.values()), self.loads
        check_frame_only(self.section, self.input, loads, self.specification)
        check_coordinates(lattice, self.supports, given, outputs, loads)
        supports = self.supports.merged(lattice.dimension)
        object.__setattr__(self, "supports", supports)
        check_regions(lattice, supports, given, outputs, loads, sliding=self.section is not None)
        for output in outputs:
            check_connection(lattice, given, output)
        if self.section is not None and self.material is None:
            object.__setattr__(self, "material", DEFAULT_MATERIAL)
        beam_count = lattice.beam_count
        initial = np.ones(beam_count, dtype=np.bool_) if self.initial is None else self.initial
        initial = boolean_mask("initial", initial, beam_count)
        if self.designable is None:
            designable = np.flatnonzero(~lattice.beams_touching(self.special_nodes_of_all_cases))
        else:
            designable = np.sort(id_list("designable", self.designable))
            check_ids("designable", id_list("designable", self.designable), beam_count, "beam")
        if len(designable) == 0:
            raise InvalidProblem(
                "designable: no beam is left to design; by default these are the beams "
                "that touch no support, input or output node"
            )
        object.__setattr__(self, "initial", locked(initial))
        object.__setattr__(self, "designable", locked(designable))
        object.__setattr__(self, "widths", check_widths(lattice, self.section, self.widths))
        object.__setattr__(self, "joints", check_joints(lattice, self.joints))
        if self.section is not None:
            possible = initial | np.isin(np.arange(beam_count), designable)
            check_slender(lattice, self.section, self.beam_widths, possible)
        for case in () if self.specification is None else self.specification.cases:
            self._problem_of(case)

    __reduce__ = rebuild

    @property
    def is_specified(self) -> bool:
        """Whether the problem says what a design must meet or maximise."""
        wanted = self.specification
        return wanted is not None and bool(wanted.items or wanted.maximise)

    @property
    def beam_widths(self) -> NDArray[np.float64]:
        """Width of each beam of a frame, (M,), lattice units."""
        if self.widths is not None:
            return self.widths
        assert self.section is not None
        return np.full(self.lattice.beam_count, self.section.width)

    @property
    def beam_joints(self) -> NDArray[np.float64]:
        """Lengths of both ends of each beam that do not bend, (M, 2), lattice units."""
        if self.joints is not None:
            return self.joints
        assert self.section is not None
        each = self.section.joint / self.section.width * self.beam_widths
        return np.stack([each, each], axis=1)

    def with_geometry(
        self, positions: NDArray[np.float64], widths: NDArray[np.float64] | None
    ) -> Problem:
        """Return the same problem with its nodes elsewhere and other widths of its beams.

        Parameters
        ----------
        positions : (N, d) float64, lattice units
        widths : (M,) float64, lattice units
            None for the width of the section.

        Raises
        ------
        InvalidProblem
            If a beam is not longer than wide.

        Examples
        --------
        >>> from bellcrank.model import Section, find_problem
        >>> crane = replace(find_problem("crane"), section=Section(0.2, 0.5))
        >>> wide = crane.with_geometry(crane.lattice.positions, np.full(352, 0.25))
        >>> wide.beam_widths[:2]
        array([0.25, 0.25])
        """
        lattice = replace(self.lattice, positions=positions)
        return replace(self, lattice=lattice, widths=widths, joints=None)

    @property
    def has_ranges(self) -> bool:
        """Whether an input or a load grows in a part of the stroke only."""
        return bool((np.concatenate([self.input.ranges, self.loads.ranges]) != WHOLE).any())

    @property
    def kinks(self) -> tuple[float, ...]:
        """Fractions within the stroke at which an input or a load starts or stops growing."""
        if not self.has_ranges:
            return ()
        return kinks_of(np.concatenate([self.input.ranges, self.loads.ranges]))

    @property
    def special_nodes(self) -> NDArray[np.int64]:
        """Nodes of supports, input, outputs and loads, sorted."""
        outputs = [output.nodes for output in self.outputs.values()]
        used = [self.supports.nodes, self.input.nodes, self.loads.nodes, *outputs]
        return np.unique(np.concatenate(used))

    @property
    def special_nodes_of_all_cases(self) -> NDArray[np.int64]:
        """The same of all load cases."""
        used = [self.special_nodes]
        for case in () if self.specification is None else self.specification.cases:
            used += [case.supports.nodes, case.input.nodes, case.loads.nodes]
            used += [output.nodes for output in case.outputs.values()]
        return np.unique(np.concatenate(used))

    @property
    def outputs(self) -> dict[str, Output]:
        """All outputs by name, `output` first; it is named ``"output"`` without specification."""
        if self.specification is None:
            return {"output": self.output}
        return {self.specification.output: self.output, **self.specification.outputs}

    @property
    def cases(self) -> dict[str, Problem]:
        """Problems of the load cases by name, the first one being that of the problem itself.

        Each has the outputs of its case, and no items.
        """
        wanted = self.specification
        if wanted is None:
            return {"case": self}
        own = Specification(case=wanted.case, output=wanted.output, outputs=wanted.outputs)
        first = replace(self, specification=own)
        return {wanted.case: first} | {case.name: self._problem_of(case) for case in wanted.cases}

    def _problem_of(self, case: Case) -> Problem:
        """Return the problem of a further load case."""
        (name, output), *others = case.outputs.items()
        own = Specification(case=case.name, output=name, outputs=dict(others))
        try:
            return replace(
                self, supports=case.supports, input=case.input, output=output, loads=case.loads,
                specification=own,
            )  # fmt: skip
        except InvalidProblem as error:
            raise InvalidProblem(f"case {case.name!r}: {error}") from None

    def full_design(self) -> Design:
        """Return the design with all the beams of `initial`."""
        return Design(problem=self, mask=self.initial)

    @property
    def hash(self) -> str:
        """SHA-256 hash of the canonical JSON; equal for equal problems on all machines."""
        text = json.dumps(problem_to_dict(self), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """A problem with the beams that are present.

    Parameters
    ----------
    problem
        The problem, with the objective of `efficiency`.
    mask : (M,) bool
        Beams of the lattice that are present.
    efficiency
        Efficiency computed when the design was made; None if unknown.
    provenance
        Origin of the design, as data for JSON.

    Raises
    ------
    InvalidProblem
        If the mask has not one boolean for each beam, or the efficiency is not finite.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> design = find_problem("scaling-8").full_design()
    >>> design.beam_count
    219
    >>> design.with_mask(~design.mask).beam_count
    0
    """

    problem: Problem
    mask: NDArray[np.bool_]
    efficiency: float | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        mask = boolean_mask("mask", self.mask, self.problem.lattice.beam_count)
        object.__setattr__(self, "mask", locked(mask))
        if self.efficiency is not None:
            efficiency = float(real_array("efficiency", self.efficiency))
            object.__setattr__(self, "efficiency", efficiency)
        object.__setattr__(self, "provenance", deepcopy(dict(self.provenance)))

    __reduce__ = rebuild

    @property
    def beam_count(self) -> int:
        """Number of beams present."""
        return int(np.count_nonzero(self.mask))

    @property
    def mask_hex(self) -> str:
        """Mask as hexadecimal text."""
        return pack_mask(self.mask)

    def with_mask(self, mask: ArrayLike) -> Design:
        """Return a design with other beams and without efficiency."""
        return replace(self, mask=np.asarray(mask), efficiency=None)


def problem_to_dict(problem: Problem) -> dict[str, Any]:
    """Return a problem in full as plain data (schema ``bellcrank/problem/1``).

    Two problems are equal if and only if their data are equal: `Problem.hash` is computed from
    them.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> data = problem_to_dict(find_problem("crane"))
    >>> data["schema"], data["input"]["direction"], len(data["designable"])
    ('bellcrank/problem/1', [0.0, -1.0], 203)
    """
    data: dict[str, Any] = {
        "schema": PROBLEM_SCHEMA,
        "name": problem.name,
        "positions": problem.lattice.positions.tolist(),
        "beams": problem.lattice.beams.tolist(),
        "initial": pack_mask(problem.initial),
        "designable": problem.designable.tolist(),
        "stiffness": {"bond": problem.stiffness.bond, "angle": problem.stiffness.angle},
        "supports": supports_data(problem.supports, problem.lattice.dimension),
        "input": input_data(problem.input),
        "output": output_data(problem.output),
        "aggregate": problem.aggregate,
    }
    wanted, dimension = problem.specification, problem.lattice.dimension
    optional = {
        "objective": problem.objective,
        "section": problem.section and problem.section.to_dict(),
        "material": problem.material and asdict(problem.material),
        "widths": None if problem.widths is None else problem.widths.tolist(),
        "joints": None if problem.joints is None else problem.joints.tolist(),
        "loads": problem.loads.to_dict() if problem.loads else None,
        "specification": wanted and specification_data(wanted, dimension),
    }
    return data | {key: value for key, value in optional.items() if value is not None}
