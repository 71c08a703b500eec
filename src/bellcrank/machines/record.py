"""A characterisation as a file: JSON of the schema ``bellcrank/two-port/1``.

Keys are those of `Characterisation`, arrays are lists, and what is infinite or no number is null::

    {"schema": "bellcrank/two-port/1", "name": "crane", "problem_hash": "...", "mask": "...",
     "beams": 352, "unloaded_beams": "keep", "drive": "displacement",
     "input": {"nodes": [...], "centre": [9.0, 8.66], "direction": [0.0, -1.0]}, "output": {...},
     "rest": {"input_stiffness": 9.686, "efficiency": -0.0439, "output_compliance": 0.1675},
     "blocks": [[...], ...],
     "curves": [{"load": "free", "motion": [...], "input_force": [...], "output": [...],
                 "output_force": [...], "energy": [...], "status": "converged", "reached": 1.0}],
     "potentials": {"mean": {...}}, "doubts": [], "provenance": {...}}
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.machines.characterise import Characterisation
from bellcrank.machines.curves import PortCurve
from bellcrank.machines.loads import Load
from bellcrank.machines.ports import Port
from bellcrank.machines.potential import Potential
from bellcrank.machines.sampling import Fit
from bellcrank.machines.tables import (
    SCHEMA,
    CharacterisationTable,
    CurveTable,
    PortTable,
    PotentialTable,
)
from bellcrank.machines.two_port import TwoPort
from bellcrank.mechanics import Status
from bellcrank.model.parsing import parse, read_json
from bellcrank.model.storage import write_text

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from numpy.typing import NDArray

SYMMETRIC = 1e-8
"""Largest asymmetry of a stiffness that is read, as a part of its largest entry."""


def characterisation_to_dict(found: Characterisation) -> dict[str, Any]:
    """Return a characterisation as plain data, ready for JSON.

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
    return {
        "schema": SCHEMA,
        "name": found.name,
        "problem_hash": found.problem_hash,
        "mask": found.mask,
        "beams": found.beams,
        "unloaded_beams": found.unloaded_beams,
        "drive": found.drive,
        "input": _port(found.input),
        "output": _port(found.output),
        "rest": {
            "input_stiffness": found.rest.input_stiffness,
            "efficiency": found.rest.efficiency,
            "output_compliance": compliance if math.isfinite(compliance) else None,
        },
        "blocks": None if found.blocks is None else found.blocks.tolist(),
        "curves": [_curve(curve) for curve in found.curves],
        "potentials": {name: fit_to_dict(one) for name, one in found.potentials.items()},
        "doubts": list(found.doubts),
        "provenance": dict(found.provenance),
    }


def _port(port: Port) -> dict[str, Any]:
    return {name: getattr(port, name).tolist() for name in ("nodes", "centre", "direction")}


def _curve(curve: PortCurve) -> dict[str, Any]:
    columns = ("motion", "input_force", "output", "output_force", "energy")
    return {
        "load": curve.load.label,
        **{name: getattr(curve, name).tolist() for name in columns},
        "status": curve.status.label,
        "reached": curve.reached,
    }


def fit_to_dict(fitted: Fit) -> dict[str, Any]:
    """Return a fitted potential as plain data, ready for JSON."""
    arrays = ("prescribed", "quadratic", "scale", "exponents", "coefficients")
    measured = ("low", "high", "error", "typical_error")
    return {
        **{name: getattr(fitted.potential, name).tolist() for name in arrays},
        **{name: getattr(fitted, name) for name in ("degree", "samples", "held_out", "lost")},
        **{name: getattr(fitted, name).tolist() for name in measured},
    }


def characterisation_from_dict(data: Mapping[str, Any], source: str) -> Characterisation:
    """Read plain data back.

    Parameters
    ----------
    data
        As `characterisation_to_dict` makes it.
    source
        What to call it in an error, usually the file.

    Raises
    ------
    InvalidFile
        With one sentence about the first thing that is wrong.
    """
    table = parse(CharacterisationTable, data, source)
    compliance = table.rest.output_compliance
    if compliance is not None and compliance <= 0.0:
        raise InvalidFile(f"{source}: rest.output_compliance: expected more than 0 or null")
    if table.rest.input_stiffness < -SYMMETRIC:
        raise InvalidFile(f"{source}: rest.input_stiffness: expected at least 0")
    return Characterisation(
        name=table.name,
        problem_hash=table.problem_hash,
        mask=table.mask,
        beams=table.beams,
        unloaded_beams=table.unloaded_beams,
        drive=table.drive,
        input=_read_port(table.input, f"{source}: input"),
        output=_read_port(table.output, f"{source}: output"),
        rest=TwoPort(
            table.rest.input_stiffness,
            table.rest.efficiency,
            math.inf if compliance is None else compliance,
        ),
        blocks=_read_blocks(table.blocks, f"{source}: blocks"),
        curves=tuple(
            _read_curve(curve, f"{source}: curves[{number}]")
            for number, curve in enumerate(table.curves)
        ),
        potentials={
            name: _read_fit(one, f"{source}: potentials.{name}")
            for name, one in table.potentials.items()
        },
        doubts=tuple(table.doubts),
        provenance=dict(table.provenance),
    )


def _array(values: list[Any], shape: tuple[int, ...], where: str) -> NDArray[Any]:
    """Return a list as an array of the shape that it must have."""
    try:
        array = np.array(values)
    except ValueError:
        raise InvalidFile(f"{where}: expected rows of equal length") from None
    if array.size == 0 and 0 in shape:
        array = array.reshape(shape)
    if array.shape != shape:
        raise InvalidFile(f"{where}: expected shape {shape}, got {array.shape}")
    return array


def _read_port(table: PortTable, where: str) -> Port:
    return Port(
        nodes=np.array(table.nodes, dtype=np.int64),
        centre=_array(table.centre, (2,), f"{where}.centre"),
        direction=_array(table.direction, (2,), f"{where}.direction"),
    )


def _read_symmetric(values: list[list[float]], size: int, where: str) -> NDArray[np.float64]:
    matrix = _array(values, (size, size), where).astype(np.float64)
    if np.abs(matrix - matrix.T).max() > SYMMETRIC * np.abs(matrix).max():
        raise InvalidFile(f"{where}: expected a symmetric matrix (Maxwell and Betti)")
    return matrix


def _read_blocks(values: list[list[float]] | None, where: str) -> NDArray[np.float64] | None:
    if values is None:
        return None
    matrix = _read_symmetric(values, 6, where)
    lowest = np.linalg.eigvalsh(matrix)[0]
    if lowest < -SYMMETRIC * np.abs(matrix).max():
        raise InvalidFile(
            f"{where}: expected a positive semidefinite matrix, got a stiffness of {lowest:.3g} in "
            "one direction"
        )
    return matrix


def _read_curve(table: CurveTable, where: str) -> PortCurve:
    try:
        load = Load.read(table.load)
    except InvalidSettings as error:
        raise InvalidFile(f"{where}.{error}") from None
    length = (len(table.motion),)
    columns = {
        name: _array(getattr(table, name), length, f"{where}.{name}").astype(np.float64)
        for name in ("motion", "input_force", "output", "output_force", "energy")
    }
    if not table.motion:
        raise InvalidFile(f"{where}.motion: expected at least one point")
    return PortCurve(
        load=load, status=Status[table.status.upper()], reached=table.reached, **columns
    )


def fit_from_dict(data: Mapping[str, Any], source: str) -> Fit:
    """Read back what `fit_to_dict` made.

    Raises
    ------
    InvalidFile
        With one sentence about the first thing that is wrong.
    """
    return _read_fit(parse(PotentialTable, data, source), source)


def _read_fit(table: PotentialTable, where: str) -> Fit:
    count, terms = len(table.prescribed), len(table.coefficients)
    by_variable = {
        name: _array(getattr(table, name), (count,), f"{where}.{name}").astype(np.float64)
        for name in ("scale", "low", "high", "error", "typical_error")
    }
    exponents = _array(table.exponents, (terms, count), f"{where}.exponents").astype(np.int64)
    if (exponents < 0).any():
        raise InvalidFile(f"{where}.exponents: expected none below 0")
    scale = by_variable.pop("scale")
    if (scale <= 0.0).any():
        raise InvalidFile(f"{where}.scale: expected numbers above 0")
    potential = Potential(
        prescribed=np.array(table.prescribed, dtype=np.bool_),
        quadratic=_read_symmetric(table.quadratic, count, f"{where}.quadratic"),
        scale=scale,
        exponents=exponents,
        coefficients=np.array(table.coefficients, dtype=np.float64),
    )
    return Fit(
        potential=potential,
        degree=table.degree,
        samples=table.samples,
        held_out=table.held_out,
        lost=table.lost,
        **by_variable,
    )


def read_characterisation(path: str | os.PathLike[str]) -> Characterisation:
    """Read a record.

    Raises
    ------
    InvalidFile
        With one sentence about the first thing that is wrong.
    """
    return characterisation_from_dict(read_json(path), str(path))


def write_characterisation(
    found: Characterisation, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write a record, whole or not at all.

    Raises
    ------
    OutputExists, StorageError
    """
    text = json.dumps(characterisation_to_dict(found), indent=1) + "\n"
    write_text(path, text, overwrite=overwrite)
