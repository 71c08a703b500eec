"""Supports, inputs, loads and outputs of the load cases of a task."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model import Case, Input, Loads, NodeForce, NodeSpring, Output, Supports
from bellcrank.model.stroke_ranges import WHOLE, check_cover, stroke_range
from bellcrank.task.shapes import nodes_at
from bellcrank.task.values import unit_vector

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.part import PartSpec
    from bellcrank.task.items import ItemReader
    from bellcrank.task.schema import (
        CaseSection,
        InputSection,
        LoadSection,
        NodeRegions,
        OutputSection,
        SupportSection,
    )
    from bellcrank.task.units import ProblemUnits

SMALLEST_STROKE = 1e-3
"""Smallest displacement of an input, in spacings."""
SHORTEST_RANGE = 0.01
"""Smallest part of the stroke in which an input or a load may grow."""


@dataclass(frozen=True, slots=True, eq=False)
class CaseReader:
    """Reads load cases into the units of a problem.

    Parameters
    ----------
    part
        Size and material of the part.
    units
        Units of the problem.
    positions : (N, d)
        Nodes of the lattice, mm.
    spacing
        Distance of neighbouring nodes, mm.
    supports
        Supports of all cases.
    base
        Bundled problem that a task refers to, if it does.
    """

    part: PartSpec
    units: ProblemUnits
    positions: NDArray[np.float64]
    spacing: float
    supports: Sequence[SupportSection]
    base: Problem | None

    def _nodes(self, regions: NodeRegions, key: str) -> NDArray[np.int64]:
        return nodes_at(regions, self.positions, self.spacing, key)

    @property
    def dimension(self) -> int:
        """2 in the plane, 3 in space."""
        return int(self.positions.shape[1])

    def vector(self, direction: tuple[float, ...] | str, key: str) -> NDArray[np.float64]:
        """Return (d,) the unit vector of a direction."""
        return np.array(unit_vector(direction, self.dimension, key))

    def _supports(self, sections: Sequence[tuple[str, SupportSection]]) -> Supports:
        held: dict[str, list[NDArray[np.int64]]] = {"all": [], "x": [], "y": [], "z": []}
        for key, section in sections:
            if section.hold == "z" and self.dimension == 2:
                raise InvalidProblem(
                    f"{key}.hold: expected 'all', 'x' or 'y' in the plane, got 'z'"
                )
            held[section.hold].append(self._nodes(section.at, f"{key}.at"))
        nodes = {
            hold: np.unique(np.concatenate(each)) if each else np.empty(0, np.int64)
            for hold, each in held.items()
        }
        return Supports(
            fixed=nodes["all"], fixed_x=nodes["x"], fixed_y=nodes["y"], fixed_z=nodes["z"]
        )

    def case(self, name: str, case: CaseSection, key: str, reader: ItemReader) -> Case:
        """Return a load case, and read its items.

        Parameters
        ----------
        name
            Name of the case.
        case
            Its table.
        key
            Key of the table, for errors.
        reader
            Reads the items.

        Raises
        ------
        InvalidProblem
            With the key of the first error.
        """
        given = [(f"supports[{k}]", each) for k, each in enumerate(self.supports)]
        given += [(f"{key}.supports[{k}]", each) for k, each in enumerate(case.supports)]
        if given:
            supports = self._supports(given)
        elif self.base is not None:
            supports = self.base.supports
        else:
            raise InvalidProblem("supports: expected at least one support of the part")
        push, loads = self._input(case, key), self._loads(case, key)
        check_cover(f"{key}.inputs.during", np.concatenate([push.ranges, loads.ranges]))
        outputs = self._outputs(case, key, reader)
        reader.read("input_force", case.input_force, f"{key}.input_force")
        reader.read("strain", case.strain, f"{key}.strain")
        return Case(
            name=name,
            supports=supports,
            input=push,
            outputs=outputs,
            loads=loads,
        )

    def _input(self, case: CaseSection, key: str) -> Input:
        """Return the input of a case; several of them must be driven alike."""
        if not case.inputs:
            if self.base is None:
                raise InvalidProblem(f"{key}.inputs: expected at least one")
            return self.base.input
        parts = [
            self._one_input(section, f"{key}.inputs[{k}]") for k, section in enumerate(case.inputs)
        ]
        first = parts[0]
        for k, other in enumerate(parts[1:], 1):
            alike = math.isclose(other.amount, first.amount, rel_tol=1e-9)
            if other.drive != first.drive or not alike:
                raise InvalidProblem(
                    f"{key}.inputs[{k}]: expected the same displacement as that of the first "
                    "input, or the same force on each node; give another force as a load"
                )
        during = np.concatenate(
            [
                np.tile(_range(section.during, f"{key}.inputs[{k}].during"), (len(each.nodes), 1))
                for k, (section, each) in enumerate(zip(case.inputs, parts, strict=True))
            ]
        )
        return Input(
            nodes=np.concatenate([each.nodes for each in parts]),
            direction=np.concatenate([each.direction for each in parts]),
            drive=first.drive,
            amount=first.amount,
            during=during,
        )

    def _one_input(self, section: InputSection, key: str) -> Input:
        base = None if self.base is None else self.base.input
        if section.at is None and base is None:
            raise InvalidProblem(f"key '{key}.at' is missing")
        if section.direction is None and base is None:
            raise InvalidProblem(f"key '{key}.direction' is missing")
        both = section.displacement is not None and section.force is not None
        neither = section.displacement is None and section.force is None
        if both or (neither and base is None):
            raise InvalidProblem(f"{key}: expected displacement or force, and not both")
        nodes = base.nodes if section.at is None else self._nodes(section.at, f"{key}.at")  # type: ignore[union-attr]
        if section.direction is None:
            direction: Any = base.direction  # type: ignore[union-attr]
        else:
            direction = self.vector(section.direction, f"{key}.direction")
        if section.displacement is not None:
            amount = self._displacement(section.displacement, f"{key}.displacement")
            return Input(nodes, direction, "displacement", amount)
        if section.force is not None:
            if section.force <= 0.0:
                raise InvalidProblem(
                    f"{key}.force: expected a force above 0, got {section.force:g}; turn the "
                    "direction for the opposite force"
                )
            amount = self.units.in_problem("force", section.force) / len(nodes)
            return Input(nodes, direction, "force", amount)
        assert base is not None
        return replace(base, nodes=nodes, direction=direction)

    def _displacement(self, value: float, key: str) -> float:
        size = float(np.ptp(self.positions, axis=0).max())
        if value <= 0.0:
            raise InvalidProblem(
                f"{key}: expected a length above 0, got {value:g}; turn the direction for the "
                "opposite motion"
            )
        if value > size:
            raise InvalidProblem(
                f"{key}: {value:g} mm is more than the size of the domain, {size:.4g} mm; "
                "lengths without a unit are in mm"
            )
        if value < SMALLEST_STROKE * self.spacing:
            raise InvalidProblem(
                f"{key}: {value:g} mm is less than a thousandth of the spacing, "
                f"{self.spacing:g} mm; lengths without a unit are in mm (0.004 m is written "
                "'0.004m')"
            )
        return value / self.part.scale

    def _loads(self, case: CaseSection, key: str) -> Loads:
        forces, springs = [], []
        for k, section in enumerate(case.loads):
            where = f"{key}.loads[{k}]"
            if (section.force is None) == (section.spring is None):
                raise InvalidProblem(f"{where}: expected force or spring, and not both")
            nodes = self._nodes(section.at, f"{where}.at")
            if section.during is not None and section.force is None:
                raise InvalidProblem(f"{where}.during: expected a force, got a spring")
            if section.force is not None:
                total = self.units.in_problem("force", section.force)
                direction = self.vector(section.direction, f"{where}.direction")
                during = _range(section.during, f"{where}.during")
                forces.append(NodeForce(nodes, total / len(nodes) * direction, during))
            else:
                springs.append(self._spring(nodes, section, where))
        if case.gravity is None:
            if case.gravity_during is not None:
                raise InvalidProblem(f"{key}.gravity_during: expected {key}.gravity, too")
            return Loads(tuple(forces), tuple(springs))
        weight = self.weight(case.gravity, f"{key}.gravity")
        during = _range(case.gravity_during, f"{key}.gravity_during")
        return Loads(tuple(forces), tuple(springs), weight, during)

    def _spring(self, nodes: NDArray[np.int64], section: LoadSection, key: str) -> NodeSpring:
        assert section.spring is not None
        if section.spring <= 0.0:
            raise InvalidProblem(
                f"{key}.spring: expected a stiffness above 0, got {section.spring}"
            )
        stiffness = self.units.in_problem("stiffness", section.spring) / len(nodes)
        direction: Any = self.vector(section.direction, f"{key}.direction")
        return NodeSpring(nodes, direction, stiffness)

    def _outputs(self, case: CaseSection, key: str, reader: ItemReader) -> dict[str, Output]:
        """Return the outputs of a case by name, and read their items."""
        if not case.outputs:
            raise InvalidProblem(f"{key}.outputs: expected at least one")
        outputs: dict[str, Output] = {}
        for k, section in enumerate(case.outputs):
            where = f"{key}.outputs[{k}]"
            alone = len(case.outputs) == 1
            name = section.name or ("output" if alone else f"output{k + 1}")
            if name in outputs:
                raise InvalidProblem(f"{where}.name: the name {name!r} is given twice")
            outputs[name] = self._output(section, where)
            for quantity in (
                "gain", "travel", "off_axis", "rotation", "stiffness", "payload",
                "dead_load", "blocked_force", "sag",
            ):  # fmt: skip
                wanted = getattr(section, quantity)
                reader.read(quantity, wanted, f"{where}.{quantity}", name)
            if section.path is not None:
                along = tuple(outputs[name].direction[0].tolist())
                reader.path(section.path, along, f"{where}.path", name)
        return outputs

    def _output(self, section: OutputSection, key: str) -> Output:
        base = None if self.base is None else self.base.output
        if section.at is None and base is None:
            raise InvalidProblem(f"key '{key}.at' is missing")
        nodes = base.nodes if section.at is None else self._nodes(section.at, f"{key}.at")  # type: ignore[union-attr]
        if section.direction is None and base is not None:
            direction: Any = base.direction
        else:
            direction = self.vector(section.direction or "up", f"{key}.direction")
        spring = None
        if section.spring is not None:
            if section.spring <= 0.0:
                raise InvalidProblem(
                    f"{key}.spring: expected a stiffness above 0, got {section.spring:g}"
                )
            spring = self.units.in_problem("stiffness", section.spring) / len(nodes)
        return Output(nodes, direction, spring)

    def weight(self, direction: tuple[float, ...] | str, key: str) -> NDArray[np.float64]:
        """Return the own weight: force on a unit of volume."""
        if math.isnan(self.units.density):
            raise InvalidProblem(
                f"part.material: the density of {self.part.registered_material.name} is unknown, "
                "which sag and gravity need; give a material with density"
            )
        weight: NDArray[np.float64] = self.units.weight * self.vector(direction, key)
        return weight


def _range(during: tuple[float, float] | None, key: str) -> tuple[float, float]:
    """Return the fractions of the stroke between which an input or a load grows."""
    return WHOLE if during is None else stroke_range(key, during, SHORTEST_RANGE)
