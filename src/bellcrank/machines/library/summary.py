"""An entry in a line: what lists, searches and index files hold of it."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from bellcrank.errors import InvalidFile
from bellcrank.machines.library.files import checked_table
from bellcrank.machines.tables import CharacterisationTable
from bellcrank.machines.two_port import TwoPort
from bellcrank.model.files import DesignTable
from bellcrank.model.parsing import Table, parse, read_json
from bellcrank.model.storage import write_text

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

INDEX = "index.json"
SCHEMA = "bellcrank/entry-index/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """The figures of an entry that people choose by.

    Parameters
    ----------
    name, direction, columns, kind
        As in `Entry`.
    beams
        How many it has.
    efficiency
        At the full stroke, under the load that it was made for.
    free_efficiency, input_stiffness, output_compliance
        The two-port at rest; the last is infinite for an output that nothing holds.
    frame_efficiency, frame_status
        By finite elements; nan where no stable path leads to the full stroke.
    lever_efficiency
        Of the plain lever; nan where none is stable.
    better
        Whether it is more efficient than that.
    clear
        Whether there is nothing to be warned of: struts that touch, a loss of stability.
    """

    name: str
    direction: str
    columns: int | None
    kind: str
    beams: int
    efficiency: float
    free_efficiency: float
    input_stiffness: float
    output_compliance: float
    frame_efficiency: float
    frame_status: str
    lever_efficiency: float
    better: bool
    clear: bool

    @property
    def hash(self) -> str:
        """The end of its name."""
        return self.name.rpartition("-")[2]

    @property
    def two_port(self) -> TwoPort:
        """The linear two-port."""
        return TwoPort(self.input_stiffness, self.free_efficiency, self.output_compliance)


class SummaryTable(Table):
    """An entry of an index; null for what is no number."""

    name: str
    direction: str
    columns: int | None
    kind: str
    beams: int
    efficiency: float | None
    free_efficiency: float
    input_stiffness: float
    output_compliance: float | None
    frame_efficiency: float | None
    frame_status: str
    lever_efficiency: float | None
    better: bool
    clear: bool


class IndexTable(Table):
    """A whole index file."""

    schema_: Literal["bellcrank/entry-index/1"] = Field(alias="schema")
    entries: list[SummaryTable]


def read_summary(path: str | os.PathLike[str]) -> Summary:
    """Read the figures of an entry, without building its lattice.

    Raises
    ------
    InvalidFile
        If it is no entry, or has been changed since it was written.
    """
    source = str(path)
    table = checked_table(read_json(path), source)
    found = parse(CharacterisationTable, table.characterisation, f"{source}: characterisation")
    design = parse(DesignTable, table.design, f"{source}: design")
    if Path(path).stem != table.name:
        raise InvalidFile(f"{path}: holds the entry {table.name}, and must be called like it")
    return _summary(
        SummaryTable(
            name=table.name,
            direction=table.direction,
            columns=table.columns,
            kind=table.kind,
            beams=found.beams,
            efficiency=design.efficiency,
            free_efficiency=found.rest.efficiency,
            input_stiffness=found.rest.input_stiffness,
            output_compliance=found.rest.output_compliance,
            frame_efficiency=table.validation.efficiency,
            frame_status=table.validation.status,
            lever_efficiency=table.lever.efficiency,
            better=table.lever.better,
            clear=not (table.validation.warnings or found.doubts),
        )
    )


def read_index(folder: Path) -> list[Summary] | None:
    """Return what the index of a folder says; None if there is none, or it is out of date.

    Raises
    ------
    InvalidFile
        If it is damaged.
    """
    path = folder / INDEX
    if not path.is_file():
        return None
    table = parse(IndexTable, read_json(path), str(path))
    if {row.name for row in table.entries} != {each.stem for each in entry_files(folder)}:
        return None
    return [_summary(row) for row in table.entries]


def write_index(folder: Path, summaries: Sequence[Summary]) -> None:
    """Write the index of a folder anew.

    Raises
    ------
    StorageError
    """
    rows = ",\n".join(
        json.dumps(summary_to_dict(each)) for each in sorted(summaries, key=lambda each: each.name)
    )
    text = f'{{"schema": "{SCHEMA}", "entries": [\n{rows}\n]}}\n'
    write_text(folder / INDEX, text, overwrite=True)


def summary_to_dict(summary: Summary) -> dict[str, Any]:
    """Return a summary as plain data; null for what is no number."""
    told = {field.name: getattr(summary, field.name) for field in fields(summary)}
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in told.items()
    }


def entry_files(folder: Path) -> list[Path]:
    """Return the files of a folder that are entries by their name, in order."""
    if not folder.is_dir():
        return []
    return sorted(
        path for path in folder.glob("*.json") if path.name != INDEX and path.name[0] != "."
    )


def _summary(row: SummaryTable) -> Summary:
    told = row.model_dump()
    for name in ("efficiency", "frame_efficiency", "lever_efficiency"):
        told[name] = math.nan if told[name] is None else told[name]
    if told["output_compliance"] is None:
        told["output_compliance"] = math.inf
    return Summary(**told)
