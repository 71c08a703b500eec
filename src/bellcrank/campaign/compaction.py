"""Compaction: the segments of a finished campaign become a table of a few large files.

The rows are sorted by run and step: neighbouring designs differ by a beam or two, which makes
them small. The statistics of the efficiency in each row group let a search for the best designs
skip most groups. The header of each part keeps the footers of its segments, so that `expand` can
restore the segments to the last byte.

A kill at any instant loses nothing: the parts are written once in a folder that readers do not
see; then the link is switched in one step; then the segments are deleted.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from bellcrank.campaign.store import (
    PART_NAME,
    TABLE,
    TABLE_ADVICE,
    TOP_NAME,
    switch_link,
)
from bellcrank.errors import CorruptRun, StorageError
from bellcrank.storage.files import remove_files, remove_temporaries
from bellcrank.storage.parquet import parquet_file
from bellcrank.storage.segments import SEGMENTS, Segment
from bellcrank.storage.tables import TablePart, read_part

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from bellcrank.campaign.store import Store

PART_ROWS = 2**20
"""Approximate number of rows of a part."""


def compact(store: Store) -> None:
    """Merge the segments of a finished campaign into the table, and delete them.

    May be repeated, and run in several processes at the same time.

    Raises
    ------
    CorruptRun
        If a run is not done, or a segment is damaged; all segments are then left as they are.
    StorageError
        If there is no space for the table beside the segments.
    """
    if not store.compacted:
        try:
            plan = list(_plan(store))
            for number, segments in enumerate(plan):
                part = TablePart(part_path(store, number), number, len(plan), segments)
                if not part.path.exists():
                    tables = partial(store.segments.tables, segments)
                    store.write(part.path, tables, part.header(store.spec.hash))
            switch_link(store.path, TABLE)
        except (CorruptRun, StorageError):
            if not store.compacted:  # otherwise another process has deleted the segments
                raise
    store.segments.delete(store.segments.runs())
    remove_temporaries(store.path / TABLE, PART_NAME)
    remove_temporaries(store.path, TOP_NAME)


def part_path(store: Store, number: int) -> Path:
    """Return the path of a part of the table."""
    return store.path / TABLE / f"part-{number:05d}.parquet"


def _plan(store: Store) -> Iterator[list[Segment]]:
    """Yield the segments of each part."""
    part: list[Segment] = []
    rows = 0
    for run in store.spec.runs():
        segments = store.segments.read_all(run.id, thorough=True)
        if not segments or not segments[-1].done:
            raise CorruptRun(f"{store.path}: run {run.id} is not done; resume the campaign first")
        for segment in segments:
            part.append(segment)
            rows += segment.rows
            if rows >= PART_ROWS:
                yield part
                part, rows = [], 0
    if part:
        yield part


def read_table_part(store: Store, path: Path, *, thorough: bool) -> TablePart:
    """Read the footer of a part, and check that it is in its place.

    Raises
    ------
    CorruptRun
    """
    part = read_part(path, store.spec.hash, TABLE_ADVICE, thorough=thorough)
    if part_path(store, part.number) != path:
        raise CorruptRun(f"{path}: is part {part.number} by its footer; {TABLE_ADVICE}")
    return part


def read_parts(store: Store) -> list[TablePart]:
    """Read the footers of all parts, and check that none is missing.

    Raises
    ------
    CorruptRun
    """
    parts = [read_table_part(store, path, thorough=False) for path in store.parts()]
    present = {part.number for part in parts}
    for number in range(parts[0].count if parts else 1):
        if number not in present:
            raise CorruptRun(f"{part_path(store, number)}: missing; {TABLE_ADVICE}")
    return parts


def expand(store: Store, parts: Sequence[TablePart]) -> None:
    """Undo compaction: turn parts back into segments, make them visible, delete the table.

    Parameters
    ----------
    store
        Store of the campaign.
    parts
        Parts that are intact. The content of other parts has to be computed again.

    Raises
    ------
    StorageError
        If there is no space for the segments beside the table, which stays as it is.
    """
    for part in parts:
        with parquet_file(part.path, TABLE_ADVICE) as (file, _):
            table = file.read(use_threads=False).replace_schema_metadata()
        first_row = 0
        for segment in part.segments:
            rows = table.slice(first_row, segment.rows)
            first_row += segment.rows
            path = store.segments.path_of(segment.run, segment.first_step)
            store.write(path, partial(iter, (rows,)), store.segments.header_of(segment))
    switch_link(store.path, SEGMENTS)
    remove_files(store.path / TABLE, PART_NAME)
