"""What turns designs into parts, as it is written in files and on the command line."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.model.parsing import Table, parse, read_toml
from bellcrank.part.lengths import read_length
from bellcrank.part.materials import Material, materials
from bellcrank.part.part import Part
from bellcrank.part.section import Section

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from bellcrank.model import Design

LENGTHS = ("width", "thickness", "scale", "fillet")


@dataclass(frozen=True, slots=True, kw_only=True)
class PartSpec:
    """Size and material of parts.

    Parameters
    ----------
    width, thickness
        Of the struts, mm.
    scale
        Length of a lattice unit, mm.
    fillet
        Radius in the corners between struts, mm; None for a quarter of the width, or less where
        that leaves no room.
    material
        A name in the registry of materials, or a material.

    Raises
    ------
    UnknownName
        If there is no such material.
    """

    width: float = 2.0
    thickness: float = 5.0
    scale: float = 10.0
    fillet: float | None = None
    material: str | Material = "ninjaflex"

    def of(self, design: Design) -> Part:
        """Return a design as such a part.

        Raises
        ------
        InvalidSettings, UnknownName
        """
        material = self.material
        if isinstance(material, str):
            material = materials[material]
        return Part(design, material, Section(self.width, self.thickness), self.scale, self.fillet)

    def changed(self, changes: Mapping[str, Any]) -> PartSpec:
        """Return it with some values replaced by what a person wrote; lengths may have units.

        Raises
        ------
        InvalidSettings
            If a length is none, or a key is unknown.
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
        """Return it as plain data, that `changed` reads."""
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
        """Return what `to_dict` wrote, or what a file says.

        Raises
        ------
        InvalidFile
            Naming `source` and the first offender.
        InvalidSettings
            If a value makes no sense.
        """
        return cls().changed(_changes(data, source))


class MaterialTable(Table):
    """A material by its figures, in a file."""

    name: str = "custom"
    young: float
    poisson: float
    density: float | None = None
    strain_limit: float | None = None


class PartTable(Table):
    """What may be said of a part."""

    width: Any = None  # what is no length is refused where lengths are read
    thickness: Any = None
    scale: Any = None
    fillet: Any = None
    material: Any = None


class PartFile(PartTable):
    """A whole file of a part."""

    schema_: Literal["bellcrank/part/1"] = Field(alias="schema")


def _changes(data: object, source: str, table: type[PartTable] = PartTable) -> dict[str, Any]:
    """Return what is said of a part, checked."""
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
    r"""Read size and material of parts from a TOML file.

    Parameters
    ----------
    base
        What holds where the file says nothing.

    Raises
    ------
    InvalidFile
        If it is no such file.
    InvalidSettings
        If a value makes no sense.

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
