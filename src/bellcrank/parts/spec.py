"""What turns designs into parts, as it is written in files and on the command line."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from bellcrank.errors import InvalidSettings
from bellcrank.model.parsing import Table, parse, read_toml
from bellcrank.parts.lengths import read_length
from bellcrank.parts.materials import Material, materials
from bellcrank.parts.part import Part
from bellcrank.parts.section import Section

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
    def from_dict(cls, data: Mapping[str, Any]) -> PartSpec:
        """Return what `to_dict` wrote."""
        material = data.get("material")
        given = dict(data)
        if isinstance(material, dict):
            given["material"] = Material(**{"name": "custom", **material})
        return cls().changed(given)


class MaterialTable(Table):
    """A material by its figures, in a file."""

    name: str = "custom"
    young: float
    poisson: float
    density: float | None = None
    strain_limit: float | None = None


class PartTable(Table):
    """A whole file of a part."""

    schema_: Literal["bellcrank/part/1"] = Field(alias="schema")
    width: float | str | None = None
    thickness: float | str | None = None
    scale: float | str | None = None
    fillet: float | str | None = None
    material: MaterialTable | str | None = None


def read_part(path: str | os.PathLike[str]) -> PartSpec:
    r"""Read size and material of parts from a TOML file.

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
    table = parse(PartTable, read_toml(path), str(path))
    data = table.model_dump(exclude={"schema_"}, exclude_none=True)
    return PartSpec.from_dict(data)
