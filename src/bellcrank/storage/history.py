"""``history.parquet``: all proposals of a run in one file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.model.storage import whole_file
from bellcrank.storage.parquet import parquet_file, write_sealed
from bellcrank.storage.tables import TablePart, read_part

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from bellcrank.storage.description import Description
    from bellcrank.storage.segments import Segment, SegmentFiles

HISTORY = "history.parquet"
ADVICE = (
    "if the folder segments/ still holds the proposals, delete this file and resume; otherwise "
    "restore it from a copy, or repeat the run with the same seed, which gives the same result"
)


def read_history(folder: Path, store: str) -> TablePart | None:
    """Read the footer of the history in a folder; None if there is no such file.

    Parameters
    ----------
    folder
        Folder of the run.
    store
        Hash that identifies the run.

    Raises
    ------
    CorruptRun
        If the file is damaged or belongs to another run.
    """
    path = folder / HISTORY
    return read_part(path, store, ADVICE, thorough=False) if path.exists() else None


def chain_tables(path: Path, chain: int, names: list[str]) -> Iterator[Any]:
    """Yield the rows of one chain in a history, a pyarrow table for each row group.

    Raises
    ------
    CorruptRun
        If the file is damaged.
    """
    import pyarrow.compute as pc

    with parquet_file(path, ADVICE) as (file, _):
        order = file.schema_arrow.get_field_index("chain")
        for group in range(file.metadata.num_row_groups):
            numbers = file.metadata.row_group(group).column(order).statistics
            if numbers.min <= chain <= numbers.max:
                columns = ["chain", *names]
                table = file.read_row_group(group, columns=columns, use_threads=False)
                yield table.filter(pc.equal(table["chain"], chain)).select(names)


def write_history(
    folder: Path,
    files: SegmentFiles,
    segments: list[Segment],
    description: Description,
    schema: Any,
) -> None:
    """Merge the segments of all chains into the history of a folder.

    Raises
    ------
    StorageError
        If there is no space for it.
    """
    part = TablePart(folder / HISTORY, 0, 1, segments)
    header = {
        **part.header(description.hash),
        "provenance": description.provenance,
        **description.content,
    }
    with whole_file(part.path) as file:
        write_sealed(file, files.tables(segments), schema, header)
