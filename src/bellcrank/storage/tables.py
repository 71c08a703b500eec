"""Tables: many segments merged into one file, with their footers in its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import CorruptRun
from bellcrank.storage.parquet import check_seal, parquet_file
from bellcrank.storage.segments import Segment, check_header

if TYPE_CHECKING:
    from pathlib import Path

TABLE_SCHEMA = "bellcrank/table/1"


@dataclass(frozen=True, slots=True)
class TablePart:
    """Footer of a file that merges many segments.

    Parameters
    ----------
    path
        Path of the file.
    number, count
        Number of the part, from 0, and number of all parts.
    segments
        Footers of the segments, in the order of the rows.
    """

    path: Path
    number: int
    count: int
    segments: list[Segment]

    def header(self, store: str) -> dict[str, Any]:
        """Return what goes into the footer."""
        return {
            "schema": TABLE_SCHEMA,
            "store": store,
            "part": self.number,
            "parts": self.count,
            "segments": [segment.to_dict() for segment in self.segments],
        }


def read_part(path: Path, store: str, advice: str, *, thorough: bool) -> TablePart:
    """Read the footer of a table, and check it.

    Parameters
    ----------
    path
        Path of the file.
    store
        Hash that identifies the store.
    advice
        How to recover from a damaged file.
    thorough
        Whether to check every byte of the file, not only the footer.

    Raises
    ------
    CorruptRun
    """
    if thorough:
        check_seal(path, advice)
    with parquet_file(path, advice) as (file, header):
        check_header(path, header, TABLE_SCHEMA, store)
        segments = [Segment.from_dict(entry) for entry in header["segments"]]
        part = TablePart(path, int(header["part"]), int(header["parts"]), segments)
        rows = sum(segment.rows for segment in segments)
        if rows != file.metadata.num_rows:
            raise CorruptRun(
                f"{path}: contains {rows} rows by its footer, and has {file.metadata.num_rows}; "
                f"{advice}"
            )
    return part
