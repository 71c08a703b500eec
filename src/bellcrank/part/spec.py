"""Specification of parts: size and material, in files and on the command line."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.model.parsing import Table, parse, read_toml
from bellcrank.model.section import Section
from bellcrank.part.materials import Material, materials
from bellcrank.part.part import Part
from bellcrank.part.units import read_length

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from bellcrank.model import Design, Problem

LENGTHS = ("width", "thickness", "scale", "fillet", "joint")
JOINT = 0.3
"""Length of the ends of struts that do not bend, as a fraction of the width: the joints of frames
are then as stiff as those of the sheet with its fillets (docs/validation.md)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PartSpec:
    """Size and material of parts.

    Parameters
    ----------
    width, thickness
        Strut width and part thickness, mm.
    scale
        Length of a lattice unit, mm.
    fillet
        Radius in the corners between struts, mm; None for a quarter of the width, or less where
        there is no room for it.
    joint
        Length of the ends of struts that do not bend in frames, mm; None for 0.3 of the width.
    material
        Name of a registered material, or a material.

    Raises
    ------
    InvalidSettings
        If the joint is longer than half the width.
    """

    width: float = 2.0
    thickness: float = 5.0
    scale: float = 10.0
    fillet: float | None = None
    joint: float | None = None
    material: str | Material = "ninjaflex"

    def __post_init__(self) -> None:
        if self.joint is not None and not 0.0 <= self.joint <= 0.5 * self.width:
            raise InvalidSettings(
                f"joint: expected a length from 0 to half the width, {0.5 * self.width:g} mm, got "
                f"{self.joint:g} mm"
            )

    @property
    def registered_material(self) -> Material:
        """The material, looked up if it is a name; UnknownName if there is none of that name."""
        return materials[self.material] if isinstance(self.material, str) else self.material

    def of(self, design: Design) -> Part:
        """Return the part of a design.

        Raises
        ------
        InvalidSettings, InvalidProblem, UnknownName
        """
        for name in ("width", "thickness"):
            length = getattr(self, name)
            if not 0.0 < length < math.inf:
                raise InvalidSettings(f"{name}: expected a length above 0 mm, got {length:g}")
        section, problem = self.section(design.problem.lattice.dimension), design.problem
        modelled = problem.section
        if self.joint is None and modelled is not None:
            section = replace(section, joint=modelled.joint / modelled.width * self.width)
        if problem.joints is not None and not self.keeps_joints(problem):
            design = replace(design, problem=replace(problem, joints=None))
        return Part(design, self.registered_material, section, self.scale, self.fillet)

    def keeps_joints(self, problem: Problem) -> bool:
        """Whether parts have the joints of a design: no length is given, or that of its section."""
        modelled = problem.section
        return self.joint is None or (
            modelled is not None
            and math.isclose(self.joint * modelled.width, modelled.joint * self.width)
        )

    def section(self, dimension: int) -> Section:
        """Return the cross-section of struts with joints; mm. Round in space."""
        joint = JOINT * self.width if self.joint is None else self.joint
        if dimension == 3:
            return Section.round(self.width, joint)
        return Section(self.width, self.thickness, joint=joint)

    @classmethod
    def of_section(cls, section: Section, scale: float = 10.0) -> PartSpec:
        """Return the part whose struts have a section in lattice units.

        Parameters
        ----------
        scale
            Length of a lattice unit, mm.

        Examples
        --------
        >>> spec = PartSpec.of_section(Section(0.16, 0.4))
        >>> spec.width, spec.thickness
        (1.6, 4.0)
        """
        scaled = section.scaled(scale)
        return cls(width=scaled.width, thickness=scaled.thickness, scale=scale, joint=scaled.joint)

    def changed(self, changes: Mapping[str, Any]) -> PartSpec:
        """Return a copy with some values replaced; lengths may be texts with units.

        Raises
        ------
        InvalidSettings
            If a length cannot be read, or a key is unknown.
        """
        known = {field.name for field in fields(self)}
        unknown = sorted(set(changes) - known)
        if unknown:
            raise InvalidSettings(f"unknown key {unknown[0]!r} of a part; known: {sorted(known)}")
        read: dict[str, Any] = {
            key: read_length(key, value) if key in LENGTHS and value is not None else value
            for key, value in changes.items()
        }
        return replace(self, **read)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, which `from_dict` reads."""
        data = {field.name: getattr(self, field.name) for field in fields(self)}
        if isinstance(self.material, Material):
            figures = asdict(self.material)
            data["material"] = {
                key: value
                for key, value in figures.items()
                if key != "sources" and not (isinstance(value, float) and math.isnan(value))
            }
        return data

    @classmethod
    def from_dict(cls, data: object, source: str = "part") -> PartSpec:
        """Return the specification that plain data describes.

        Raises
        ------
        InvalidFile
            If a key is unknown or has the wrong type; names `source`.
        InvalidSettings
            If a value is outside its range.
        """
        return cls().changed(_changes(data, source))


class MaterialTable(Table):
    """A material, in a file."""

    name: str = "custom"
    young: float
    poisson: float
    density: float | None = None
    strain_limit: float | None = None
    fatigue_strain: float | None = None


class PartTable(Table):
    """Keys of a part; all optional."""

    width: Any = None  # lengths are validated by `read_length`
    thickness: Any = None
    scale: Any = None
    fillet: Any = None
    joint: Any = None
    material: Any = None


class PartFile(PartTable):
    """A part file."""

    schema_: Literal["bellcrank/part/1"] = Field(alias="schema")


def _changes(data: object, source: str, table: type[PartTable] = PartTable) -> dict[str, Any]:
    """Return the validated keys of a part."""
    if not isinstance(data, dict):
        raise InvalidFile(f"{source}: expected a table, got {data!r}")
    given = parse(table, data, source).model_dump(exclude={"schema_"}, exclude_none=True)
    material = given.get("material")
    if isinstance(material, dict):
        figures = parse(MaterialTable, material, f"{source}: material")
        given["material"] = Material(**figures.model_dump(exclude_none=True))
    elif material is not None and not isinstance(material, str):
        raise InvalidFile(f"{source}: material: expected a name or a table, got {material!r}")
    return given


def read_part(path: str | os.PathLike[str], base: PartSpec | None = None) -> PartSpec:
    r"""Read a part specification from a TOML file.

    Parameters
    ----------
    path
        The file.
    base
        Values of the keys that are not in the file.

    Raises
    ------
    InvalidFile
        If the file cannot be read or does not follow the schema.
    InvalidSettings
        If a value is outside its range.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "part.toml"
    ...     _ = path.write_text('schema = "bellcrank/part/1"\nwidth = "1.6mm"\nmaterial = "pla"')
    ...     read_part(path).width
    1.6
    """
    base = base or PartSpec()
    return base.changed(_changes(read_toml(path), str(path), PartFile))
