"""Problems from tasks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import (
    BellcrankError,
    InvalidFile,
    InvalidProblem,
    InvalidSettings,
    UnknownName,
)
from bellcrank.model import (
    Case,
    Input,
    Item,
    Lattice,
    Loads,
    NodeForce,
    NodeSpring,
    Output,
    Problem,
    Specification,
    Supports,
    builtin,
    lattices,
)
from bellcrank.model.calls import call_with_keys
from bellcrank.part import PartSpec, frame_elasticity, frame_section
from bellcrank.task.domain import fill, in_regions, region_of
from bellcrank.task.items import ItemReader
from bellcrank.task.shapes import nodes_at
from bellcrank.task.units import ProblemUnits, part_units

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model.specification import ObjectiveTerm
    from bellcrank.task.schema import (
        CaseSection,
        DomainSection,
        InputSection,
        LoadSection,
        NodeRegions,
        OutputSection,
        SupportSection,
        TaskTable,
    )

NARROWEST = 0.1
"""Smallest width and thickness of a strut, mm."""
LARGEST_PART = 5000.0
"""Largest length of a part, mm."""
SMALLEST_STROKE = 1e-3
"""Smallest displacement of an input, in spacings."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A task: the problem with its specification, and the part.

    Parameters
    ----------
    problem
        Frame problem in lattice units, with a specification.
    part
        Size and material of the part.
    units
        Conversion between both.
    description
        What the task is about.
    """

    problem: Problem
    part: PartSpec
    units: ProblemUnits
    description: str = ""


def build_task(table: TaskTable, folder: Path | None = None) -> Task:
    """Return the task that a table describes.

    Parameters
    ----------
    table
        The table.
    folder
        Folder in which outlines are looked up; the current one by default.

    Raises
    ------
    InvalidFile, InvalidProblem
        With the key of the first error.
    """
    try:
        return _Builder(table, folder or Path()).task()
    except (InvalidFile, InvalidProblem):
        raise
    except BellcrankError as error:  # an unknown material or lattice, a part that is too slender
        raise InvalidProblem(str(error)) from None


class _Builder:
    """Builds the problem of a task, part by part."""

    def __init__(self, table: TaskTable, folder: Path) -> None:
        self.table = table
        self.folder = folder
        self.part = _part(table)
        self.base = _base(table.domain)
        self.lattice = self._lattice()
        self.section = frame_section(self.part, self.lattice.dimension)
        self.material = frame_elasticity(self.lattice, self.section, self.part)
        self.units = part_units(self.lattice, self.section, self.material, self.part)
        self.positions = self.lattice.positions * self.part.scale
        self.spacing = self.part.scale * float(np.median(self.lattice.rest_length))

    def task(self) -> Task:
        table = self.table
        if not table.cases:
            raise InvalidProblem("cases: expected at least one")
        names = [case.name or f"case{k + 1}" for k, case in enumerate(table.cases)]
        if len(names) == 1 and table.cases[0].name is None:
            names = ["case"]
        cases, items, maximise = [], [], []
        scaled: list[bool] = []
        for index, (name, case) in enumerate(zip(names, table.cases, strict=True)):
            key = f"cases[{index}]" if len(names) > 1 else "cases[0]"
            reader = ItemReader(self.units, name)
            cases.append(self._case(name, case, key, reader))
            items += reader.items
            maximise += reader.maximise
            scaled += reader.scaled
        _check_objectives(maximise, scaled)
        items += self._limits(names)
        first, *others = cases
        (output_name, output), *more = first.outputs.items()
        weight = self._weight(table.limits.upright) if _bounds_sag(items) else None
        problem = Problem(
            name=table.name,
            lattice=self.lattice,
            supports=first.supports,
            input=first.input,
            output=output,
            section=self.section,
            material=self.material,
            loads=first.loads,
            specification=Specification(
                case=first.name,
                output=output_name,
                outputs=dict(more),
                cases=tuple(others),
                items=tuple(items),
                maximise=tuple(maximise),
                weight=weight,
                symmetry=tuple(table.limits.symmetry or ""),
            ),
        )
        return Task(self._with_solid(problem), self.part, self.units, table.description)

    def _lattice(self) -> Lattice:
        domain = self.table.domain
        kinds = [
            name
            for name in ("size", "outline", "lattice", "problem")
            if getattr(domain, name) is not None
        ]
        if len(kinds) != 1:
            raise InvalidProblem(
                "domain: expected one of size, outline, lattice and problem, got "
                f"{' and '.join(kinds) or 'none'}"
            )
        if kinds[0] in {"lattice", "problem"} and (domain.holes or domain.keep_out):
            raise InvalidProblem(
                f"domain: holes and keep_out apply to size and outline, not to {kinds[0]}"
            )
        if self.base is not None:
            return self.base.lattice
        if domain.lattice is not None:
            parameters = dict(domain.lattice)
            kind = parameters.pop("kind", None)
            if not isinstance(kind, str):
                raise InvalidFile(
                    f"domain.lattice.kind: expected a name ({', '.join(lattices)}), got {kind!r}"
                )
            made: Lattice = call_with_keys(lattices[kind], parameters, "domain.lattice")
            return made
        region = region_of(domain, self.folder)
        return fill(region, self.part.scale, self.part.width)

    def _nodes(self, regions: NodeRegions, key: str) -> NDArray[np.int64]:
        return nodes_at(regions, self.positions, self.spacing, key)

    def _supports(self, sections: Sequence[tuple[str, SupportSection]]) -> Supports:
        held: dict[str, list[NDArray[np.int64]]] = {"all": [], "x": [], "y": []}
        for key, section in sections:
            held[section.hold].append(self._nodes(section.at, f"{key}.at"))
        nodes = {
            hold: np.unique(np.concatenate(each)) if each else np.empty(0, np.int64)
            for hold, each in held.items()
        }
        return Supports(fixed=nodes["all"], fixed_x=nodes["x"], fixed_y=nodes["y"])

    def _case(self, name: str, case: CaseSection, key: str, reader: ItemReader) -> Case:
        given = [(f"supports[{k}]", each) for k, each in enumerate(self.table.supports)]
        given += [(f"{key}.supports[{k}]", each) for k, each in enumerate(case.supports)]
        if given:
            supports = self._supports(given)
        elif self.base is not None:
            supports = self.base.supports
        else:
            raise InvalidProblem("supports: expected at least one support of the part")
        outputs = self._outputs(case, key, reader)
        reader.read("input_force", case.input_force, f"{key}.input_force")
        reader.read("strain", case.strain, f"{key}.strain")
        return Case(
            name=name,
            supports=supports,
            input=self._input(case, key),
            outputs=outputs,
            loads=self._loads(case, key),
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
        return Input(
            nodes=np.concatenate([each.nodes for each in parts]),
            direction=np.concatenate([each.direction for each in parts]),
            drive=first.drive,
            amount=first.amount,
        )

    def _one_input(self, section: InputSection, key: str) -> Input:
        base = None if self.base is None else self.base.input
        if section.at is None and base is None:
            raise InvalidProblem(f"key '{key}.at' is missing")
        if section.direction is None and base is None:
            raise InvalidProblem(f"key '{key}.direction' is missing")
        if (section.displacement is None) == (section.force is None) and base is None:
            raise InvalidProblem(f"{key}: expected displacement or force, and not both")
        nodes = base.nodes if section.at is None else self._nodes(section.at, f"{key}.at")  # type: ignore[union-attr]
        direction: Any = base.direction if section.direction is None else section.direction  # type: ignore[union-attr]
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
            if section.force is not None:
                total = self.units.in_problem("force", section.force)
                forces.append(NodeForce(nodes, total / len(nodes) * np.array(section.direction)))
            else:
                springs.append(self._spring(nodes, section, where))
        weight = None if case.gravity is None else self._weight(case.gravity)
        return Loads(tuple(forces), tuple(springs), weight)

    def _spring(self, nodes: NDArray[np.int64], section: LoadSection, key: str) -> NodeSpring:
        assert section.spring is not None
        if section.spring <= 0.0:
            raise InvalidProblem(
                f"{key}.spring: expected a stiffness above 0, got {section.spring}"
            )
        stiffness = self.units.in_problem("stiffness", section.spring) / len(nodes)
        direction: Any = section.direction
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
                "blocked_force", "sag",
            ):  # fmt: skip
                wanted = getattr(section, quantity)
                reader.read(quantity, wanted, f"{where}.{quantity}", name)
            if section.path is not None:
                x, y = outputs[name].direction[0]
                reader.path(section.path, (float(x), float(y)), f"{where}.path", name)
        return outputs

    def _output(self, section: OutputSection, key: str) -> Output:
        base = None if self.base is None else self.base.output
        if section.at is None and base is None:
            raise InvalidProblem(f"key '{key}.at' is missing")
        nodes = base.nodes if section.at is None else self._nodes(section.at, f"{key}.at")  # type: ignore[union-attr]
        direction: Any = section.direction
        if direction is None:
            direction = (0.0, 1.0) if base is None else base.direction
        spring = None
        if section.spring is not None:
            if section.spring <= 0.0:
                raise InvalidProblem(
                    f"{key}.spring: expected a stiffness above 0, got {section.spring:g}"
                )
            spring = self.units.in_problem("stiffness", section.spring) / len(nodes)
        return Output(nodes, direction, spring)

    def _limits(self, names: Sequence[str]) -> list[Item]:
        """Return the items that hold in every case."""
        limits, items = self.table.limits, []
        strain = limits.strain
        if strain is True:
            strain = self.part.registered_material.strain_limit
        elif strain is not False and strain > 2.0:
            raise InvalidProblem(
                f"limits.strain: {strain:g} is {strain:.0%}; write '{strain:g}%' for "
                f"{strain / 100:g}"
            )
        clearance = 0.0 if limits.clearance is True else limits.clearance
        for name in names:
            if strain is not False and not math.isnan(strain):
                items.append(Item(quantity="strain", case=name, start=0.0, at_most=float(strain)))
            if clearance is not False:
                least = clearance / self.part.scale
                items.append(Item(quantity="clearance", case=name, at_least=least))
            if limits.stable_stroke is not None:
                if not 1.0 <= limits.stable_stroke <= 3.0:
                    raise InvalidProblem(
                        "limits.stable_stroke: expected a part of the stroke from 1 to 3, such as "
                        f"1.2 or '120%', got {limits.stable_stroke:g}"
                    )
                least = limits.stable_stroke
                items.append(Item(quantity="stable_stroke", case=name, at_least=least))
        if limits.mass is not None:
            items.append(self._mass(limits.mass))
        return items

    def _mass(self, mass: float) -> Item:
        """Return the item of the mass."""
        if math.isnan(self.units.density):
            raise InvalidProblem(
                f"limits.mass: the density of {self.part.registered_material.name} is unknown; "
                "give a material with density"
            )
        volume = self.section.area * float(self.lattice.rest_length.sum())
        whole = self.units.in_part("volume", volume)
        if not 0.0 < mass < whole:
            raise InvalidProblem(
                f"limits.mass: expected a mass above 0 and below that of the full lattice, "
                f"{whole:.3g} g, got {mass:g} g"
            )
        return Item(quantity="mass", at_most=self.units.in_problem("volume", mass))

    def _weight(self, direction: tuple[float, float]) -> NDArray[np.float64]:
        """Return the own weight: force on a unit of volume."""
        if math.isnan(self.units.density):
            raise InvalidProblem(
                f"part.material: the density of {self.part.registered_material.name} is unknown, "
                "which sag and gravity need; give a material with density"
            )
        weight: NDArray[np.float64] = self.units.weight * np.array(direction)
        return weight

    def _with_solid(self, problem: Problem) -> Problem:
        """Return the problem whose solid regions keep all beams."""
        if not self.table.domain.solid:
            return problem
        solid = in_regions(self.table.domain.solid, self.lattice, self.part.scale, "domain.solid")
        free = problem.designable[~solid[problem.designable]]
        return replace(problem, designable=free)


def _part(table: TaskTable) -> PartSpec:
    """Return the part of a task."""
    given = table.part
    for name, value, most in (
        ("width", given.width, LARGEST_PART),
        ("thickness", given.thickness, LARGEST_PART),
        ("spacing", given.spacing, LARGEST_PART),
    ):
        if not NARROWEST <= value <= most:
            raise InvalidProblem(
                f"part.{name}: expected a length from {NARROWEST:g} to {most:g} mm, got "
                f"{value:g} mm; lengths without a unit are in mm (0.002 m is written '0.002m')"
            )
    if given.width >= given.spacing and table.domain.problem is None:
        raise InvalidProblem(
            f"part.width: struts {given.width:g} mm wide are not slender at a spacing of "
            f"{given.spacing:g} mm; choose narrower struts or a larger spacing"
        )
    data = {
        "width": given.width, "thickness": given.thickness, "scale": given.spacing,
        "fillet": given.fillet, "material": given.material,
    }  # fmt: skip
    try:
        part = PartSpec.from_dict({k: v for k, v in data.items() if v is not None}, "part")
        part.registered_material  # noqa: B018 - raises UnknownName
    except UnknownName as error:
        raise InvalidProblem(f"part.material: {error}") from None
    except InvalidSettings as error:
        raise InvalidProblem(f"part.{error}") from None
    return part


def _base(domain: DomainSection) -> Problem | None:
    """Return the bundled problem that a task refers to."""
    if domain.problem is None:
        return None
    if domain.problem not in builtin:
        raise InvalidFile(
            f"domain.problem: unknown problem {domain.problem!r}; known: {', '.join(builtin)}"
        )
    return builtin[domain.problem]()


def _bounds_sag(items: Sequence[Item]) -> bool:
    return any(item.quantity == "sag" for item in items)


def _check_objectives(terms: Sequence[ObjectiveTerm], scaled: Sequence[bool]) -> None:
    """Check that different objectives have scales by which they are compared."""
    if len({objective.quantity for objective in terms}) > 1 and not all(scaled):
        names = ", ".join(sorted({objective.quantity for objective in terms}))
        raise InvalidProblem(
            f"cases: {names} are maximised together; expected a scale for each, such as "
            "{ maximise = true, scale = 2.0 }, in which they are compared"
        )
