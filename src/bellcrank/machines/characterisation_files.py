"""Files of characterisations: JSON with the schema ``bellcrank/two-port/1``.

Keys are those of `Characterisation`, arrays are lists, and an infinite compliance is null::

    {"schema": "bellcrank/two-port/1", "name": "crane", "problem_hash": "...", "mask": "...",
     "beams": 352, "unloaded_beams": "keep", "model": "springs", "drive": "displacement",
     "input": {"nodes": [...], "centre": [9.0, 8.66], "direction": [0.0, -1.0]}, "output": {...},
     "rest": {"input_stiffness": 9.686, "efficiency": -0.0439, "output_compliance": 0.1675},
     "curves": [{"load": "free", "motion": [...], "input_force": [...], "output": [...],
                 "output_force": [...], "energy": [...], "status": "converged", "reached": 1.0}],
     "warnings": [], "provenance": {...}}

A file without ``model`` is of the spring model.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.machines.characterisation import Characterisation
from bellcrank.machines.curves import Load, PortCurve
from bellcrank.machines.ports import Port
from bellcrank.machines.two_port import TwoPort
from bellcrank.mechanics import Status, UnloadedBeams
from bellcrank.model.parsing import Table, parse, read_json
from bellcrank.model.storage import write_text

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

SCHEMA = "bellcrank/two-port/1"
COLUMNS = ("motion", "input_force", "output", "output_force", "energy")
ROUNDING = 1e-8
"""Magnitude of a negative input stiffness that is attributed to rounding."""


class PortTable(Table):
    """A port."""

    nodes: list[int]
    centre: list[float] = Field(min_length=2, max_length=2)
    direction: list[float] = Field(min_length=2, max_length=2)


class RestTable(Table):
    """The linear two-port; null for an infinite compliance."""

    input_stiffness: float = Field(ge=-ROUNDING)
    efficiency: float
    output_compliance: float | None = Field(gt=0.0)


class CurveTable(Table):
    """A curve along the stroke."""

    load: str
    motion: list[float] = Field(min_length=1)
    input_force: list[float]
    output: list[float]
    output_force: list[float]
    energy: list[float]
    status: Literal["converged", "snapped"]
    reached: float


class CharacterisationTable(Table):
    """A file."""

    schema_: Literal["bellcrank/two-port/1"] = Field(alias="schema")
    name: str
    problem_hash: str
    mask: str
    beams: int
    unloaded_beams: UnloadedBeams
    model: Literal["springs", "frames"] = "springs"
    drive: Literal["displacement", "force"]
    input: PortTable
    output: PortTable
    rest: RestTable
    curves: list[CurveTable]
    warnings: list[str]
    provenance: dict[str, Any]


def characterisation_to_dict(found: Characterisation) -> dict[str, Any]:
    """Return a characterisation as plain data for JSON.

    Examples
    --------
    >>> from bellcrank.machines import characterise
    >>> from bellcrank.model import find_problem
    >>> found = characterise(find_problem("crane").full_design(), points=1)
    >>> plain = characterisation_to_dict(found)
    >>> plain["schema"], [curve["load"] for curve in plain["curves"]]
    ('bellcrank/two-port/1', ['free', 'blocked', 'spring:5.97'])
    """
    compliance = found.rest.output_compliance
    same = ("name", "problem_hash", "mask", "beams", "unloaded_beams", "model", "drive")
    return {
        "schema": SCHEMA,
        **{name: getattr(found, name) for name in same},
        "input": _port(found.input),
        "output": _port(found.output),
        "rest": {
            "input_stiffness": found.rest.input_stiffness,
            "efficiency": found.rest.efficiency,
            "output_compliance": compliance if math.isfinite(compliance) else None,
        },
        "curves": [_curve(curve) for curve in found.curves],
        "warnings": list(found.warnings),
        "provenance": dict(found.provenance),
    }


def characterisation_from_dict(data: Mapping[str, Any], source: str) -> Characterisation:
    """Return the characterisation of plain data.

    Parameters
    ----------
    data
        Data in the form of `characterisation_to_dict`.
    source
        Name in error messages, usually the file.

    Raises
    ------
    InvalidFile
        With the first key that is wrong.
    """
    table = parse(CharacterisationTable, data, source)
    rest = table.rest
    compliance = math.inf if rest.output_compliance is None else rest.output_compliance
    return Characterisation(
        name=table.name,
        problem_hash=table.problem_hash,
        mask=table.mask,
        beams=table.beams,
        unloaded_beams=table.unloaded_beams,
        model=table.model,
        drive=table.drive,
        input=_read_port(table.input),
        output=_read_port(table.output),
        rest=TwoPort(rest.input_stiffness, rest.efficiency, compliance),
        curves=tuple(
            _read_curve(curve, f"{source}: curves[{number}]")
            for number, curve in enumerate(table.curves)
        ),
        warnings=tuple(table.warnings),
        provenance=dict(table.provenance),
    )


def read_characterisation(path: str | os.PathLike[str]) -> Characterisation:
    """Read a characterisation.

    Raises
    ------
    InvalidFile
        With the first key that is wrong.
    """
    return characterisation_from_dict(read_json(path), str(path))


def write_characterisation(
    found: Characterisation, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write a characterisation, atomically.

    Raises
    ------
    OutputExists, StorageError
    """
    text = json.dumps(characterisation_to_dict(found), indent=1) + "\n"
    write_text(path, text, overwrite=overwrite)


def _port(port: Port) -> dict[str, Any]:
    return {name: getattr(port, name).tolist() for name in ("nodes", "centre", "direction")}


def _curve(curve: PortCurve) -> dict[str, Any]:
    return {
        "load": curve.load.label,
        **{name: getattr(curve, name).tolist() for name in COLUMNS},
        "status": curve.status.label,
        "reached": curve.reached,
    }


def _read_port(table: PortTable) -> Port:
    nodes = np.array(table.nodes, dtype=np.int64)
    return Port(nodes, np.array(table.centre), np.array(table.direction))


def _read_curve(table: CurveTable, where: str) -> PortCurve:
    try:
        load = Load.read(table.load)
    except InvalidSettings as error:
        raise InvalidFile(f"{where}.{error}") from None
    columns = {name: np.array(getattr(table, name), dtype=np.float64) for name in COLUMNS}
    for name, values in columns.items():
        if len(values) != len(table.motion):
            raise InvalidFile(
                f"{where}.{name}: expected as many points as motion, {len(table.motion)}, got "
                f"{len(values)}"
            )
    return PortCurve(
        load=load, status=Status[table.status.upper()], reached=table.reached, **columns
    )
