"""Problems from tasks."""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import (
    BellcrankError,
    InvalidFile,
    InvalidProblem,
    InvalidSettings,
    UnknownName,
)
from bellcrank.model import (
    Item,
    Lattice,
    Problem,
    Specification,
    Tolerances,
    builtin,
    lattices,
)
from bellcrank.model.calls import call_with_keys
from bellcrank.model.specification import FOLDS
from bellcrank.part import PartSpec, frame_elasticity, frame_section
from bellcrank.task.conditions import CaseReader
from bellcrank.task.domain import boundary_of, fill, in_regions, region_of
from bellcrank.task.items import ItemReader
from bellcrank.task.space import beams_in_space, body_of, fill_in_space
from bellcrank.task.units import ProblemUnits, part_units

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Design
    from bellcrank.model.specification import ObjectiveTerm
    from bellcrank.task.schema import (
        DomainSection,
        TaskTable,
    )

NARROWEST = 0.1
"""Smallest width and thickness of a strut, mm."""
SAGITTA = 0.05
"""Distance of the polyhedra of round holes from their surfaces, widths of struts."""
LARGEST_PART = 5000.0
"""Largest length of a part, mm."""


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

    def initial_design(self) -> Design:
        """Return the initial design, which records the part."""
        design = self.problem.full_design()
        return replace(design, provenance={"part": self.part.to_dict()})


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
    with _invalid_problems():
        return _Builder(table, folder or Path()).task()


def lattice_of(table: TaskTable, folder: Path | None = None) -> tuple[Lattice, PartSpec]:
    """Return lattice and part of a task whose supports and load cases may be incomplete.

    Parameters, errors
        As `build_task`.

    Examples
    --------
    >>> from bellcrank.task.schema import TaskTable
    >>> table = TaskTable(name="a", domain={"size": [62, 54]}, cases=[])
    >>> lattice_of(table)[0].node_count
    46
    """
    with _invalid_problems():
        builder = _Builder(table, folder or Path())
        return builder.lattice, builder.part


@contextmanager
def _invalid_problems() -> Iterator[None]:
    """Make other errors of a task an `InvalidProblem`: an unknown material, a part too slender."""
    try:
        yield
    except (InvalidFile, InvalidProblem):
        raise
    except BellcrankError as error:
        raise InvalidProblem(str(error)) from None


class _Builder:
    """Builds the problem of a task, part by part."""

    def __init__(self, table: TaskTable, folder: Path) -> None:
        self.table = table
        self.folder = folder
        self.part = _part(table)
        self.base = _base(table.domain)
        self.domain: tuple[NDArray[np.float64], ...] = ()
        self.lattice = self._lattice()
        self.section = frame_section(self.part, self.lattice.dimension)
        self.material = frame_elasticity(self.lattice, self.section, self.part)
        self.units = part_units(self.lattice, self.section, self.material, self.part)
        self.cases = CaseReader(
            part=self.part,
            units=self.units,
            positions=self.lattice.positions * self.part.scale,
            spacing=self.part.scale * float(np.median(self.lattice.rest_length)),
            supports=table.supports,
            base=self.base,
        )

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
            cases.append(self.cases.case(name, case, key, reader))
            items += reader.items
            maximise += reader.maximise
            scaled += reader.scaled
        _check_objectives(maximise, scaled)
        items += self._limits(names)
        first, *others = cases
        (output_name, output), *more = first.outputs.items()
        weight = (
            self.cases.weight(table.limits.upright, "limits.upright")
            if _bounds_sag(items)
            else None
        )
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
                symmetry=_symmetry_names(table.limits.symmetry, self.lattice.dimension),
                domain=self.domain,
                tolerances=self._tolerances(),
            ),
        )
        return Task(self._with_designable(problem), self.part, self.units, table.description)

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
        is_surface = isinstance(domain.outline, str) and domain.outline.lower().endswith(".stl")
        if is_surface or (domain.size is not None and len(domain.size) == 3):
            body = body_of(domain, self.folder)
            self.domain = (body.boundary(self.part.scale, SAGITTA * self.part.width),)
            return fill_in_space(body, domain, self.part)
        if domain.cells is not None:
            raise InvalidProblem(
                "domain.cells: expected a domain in space, with a size of 3 lengths or an STL file"
            )
        region = region_of(domain, self.folder)
        self.domain = boundary_of(region, self.part.scale)
        return fill(region, self.part.scale, self.part.width)

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
        if limits.strut_loss is not None:
            if not 0.0 < limits.strut_loss < 1.0:
                raise InvalidProblem(
                    "limits.strut_loss: expected a part of the efficiency between 0 and 1, such as "
                    f"'30%', got {limits.strut_loss:g}"
                )
            items.append(Item(quantity="strut_loss", at_most=limits.strut_loss))
        if limits.mass is not None:
            items.append(self._mass(limits.mass))
        return items

    def _tolerances(self) -> Tolerances | None:
        """Return the tolerances, in lattice units."""
        given = self.table.tolerance
        if given is None:
            return None
        data = given.model_dump()
        try:
            return Tolerances(**{**data, "node": data["node"] / self.part.scale})
        except InvalidProblem as error:
            raise InvalidProblem(str(error).replace("tolerances: ", "tolerance.", 1)) from None

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

    def _with_designable(self, problem: Problem) -> Problem:
        """Return the problem with the beams that a search may change: none in solid regions.

        In the plane, none at supports, inputs, outputs and loads. In space, where up to 12 beams
        meet in a node, none between two such nodes.
        """
        in_space, beams = self.lattice.dimension == 3, self.lattice.beams
        if in_space:
            fixed = np.isin(beams, problem.special_nodes_of_all_cases).all(axis=1)
        else:
            fixed = ~np.isin(np.arange(len(beams)), problem.designable)
        if self.table.domain.solid:
            regions = beams_in_space if in_space else in_regions
            fixed |= regions(self.table.domain.solid, self.lattice, self.part.scale, "domain.solid")
        return replace(problem, designable=np.flatnonzero(~fixed))


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
        "fillet": given.fillet, "joint": given.joint, "material": given.material,
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


def _symmetry_names(key: str | None, dimension: int) -> tuple[str, ...]:
    """Return the names of the symmetries that the key of the limits stands for."""
    names = (key,) if key in FOLDS else tuple(key or "")
    if dimension == 2 and not {"x", "y"}.issuperset(names):
        raise InvalidProblem(f"limits.symmetry: expected x, y or xy in the plane, got {key!r}")
    return names


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
