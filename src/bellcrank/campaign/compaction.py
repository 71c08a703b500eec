"""Compaction: the segments of a finished campaign become a table of a few large files.

Rows are sorted by run and step: neighbouring designs differ by a beam or two, which is what
makes them small. Statistics of efficiency for each row group tell a search for the best ones
where to look. The header of each part keeps what the segments' footers said, so that
`expand` can undo it all, to the last byte.

A kill at any instant loses nothing: parts are written once, under a name that readers do not
look at; one switch of a link shows the table instead of the segments; then these go.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.layout import (
    PART_NAME,
    SEGMENTS,
    TABLE,
    TOP_NAME,
    delete_segments,
    delete_table,
    part_files,
    part_path,
    segment_path,
    show,
)
from bellcrank.campaign.segments import (
    ROW_GROUP,
    SEGMENT_SCHEMA,
    Segment,
    encode,
    segment_from,
    store_content,
    store_file,
    table_schema,
)
from bellcrank.errors import CorruptRun, StorageError
from bellcrank.storage.files import remove_temporaries
from bellcrank.storage.shards import parquet_file

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from bellcrank.campaign.spec import Run
    from bellcrank.campaign.store import Store

PART_SCHEMA = "bellcrank/table/1"
PART_ROWS = 2**20
"""Rows of a part, about: few enough to hold in memory while it is made."""
WHAT_TO_DO = (
    "bellcrank campaign verify --repair turns the other parts back into segments, and resume "
    "computes the rest again"
)


@dataclass(frozen=True, slots=True)
class Part:
    """What a part of the table says about itself: the segments that it was made of."""

    path: Path
    number: int
    count: int
    segments: list[Segment]


def compact(store: Store) -> None:
    """Merge the segments of a finished campaign into the table, and delete them.

    May be repeated, and be at work several times at once.

    Raises
    ------
    CorruptRun
        If a run is not done, or a segment is damaged; all segments are then left as they are.
    StorageError
        If there is no room for the table beside the segments.
    """
    if not store.compacted:
        try:
            _write_table(store)
            show(store.path, TABLE)
        except (CorruptRun, StorageError):
            if not store.compacted:  # or another process was faster, and the segments are gone
                raise
    delete_segments(store.path)
    remove_temporaries(store.path / TABLE, PART_NAME)
    remove_temporaries(store.path, TOP_NAME)


def _write_table(store: Store) -> None:
    plan = list(_plan(store))
    for number, segments in enumerate(plan):
        if not part_path(store.path, number).exists():
            _write_part(store, number, len(plan), segments)


def _plan(store: Store) -> Iterator[list[tuple[Run, Segment]]]:
    """Yield what goes into each part."""
    part: list[tuple[Run, Segment]] = []
    rows = 0
    for run in store.spec.runs():
        segments = store.segments_of(run)
        if not segments or not segments[-1].done:
            raise CorruptRun(f"{store.path}: run {run.id} is not done; resume the campaign first")
        for segment in segments:
            part.append((run, segment))
            rows += segment.rows
            if rows >= PART_ROWS:
                yield part
                part, rows = [], 0
    if part:
        yield part


def _write_part(
    store: Store, number: int, count: int, segments: Sequence[tuple[Run, Segment]]
) -> None:
    header = {
        "schema": PART_SCHEMA,
        "spec": store.spec.hash,
        "part": number,
        "parts": count,
        "segments": [segment.to_dict() for _, segment in segments],
    }
    content = encode(_row_groups(store, segments), table_schema(store.spec.mask_bytes), header)
    store_content(part_path(store.path, number), content)


def _row_groups(store: Store, segments: Sequence[tuple[Run, Segment]]) -> Iterator[Any]:
    import pyarrow as pa

    waiting: list[Any] = []
    rows = 0
    for run, segment in segments:
        path = segment_path(store.folder_of(run), segment.first_step)
        with parquet_file(path, WHAT_TO_DO) as (file, _):
            waiting.append(file.read(use_threads=False))
        rows += segment.rows
        if rows >= ROW_GROUP:
            yield pa.concat_tables(waiting)
            waiting, rows = [], 0
    if waiting:
        yield pa.concat_tables(waiting)


def read_part(path: Path, store: Store, *, thoroughly: bool) -> Part:
    """Read what a part says about itself, and check that it is where it belongs.

    Parameters
    ----------
    thoroughly
        Check every byte of it, not only the footer.

    Raises
    ------
    CorruptRun
    """
    opened = store_file(path, PART_SCHEMA, store.spec, WHAT_TO_DO, thoroughly=thoroughly)
    with opened as (file, header):
        segments = [segment_from(entry) for entry in header["segments"]]
        part = Part(path, int(header["part"]), int(header["parts"]), segments)
        rows = sum(segment.rows for segment in segments)
        if part_path(store.path, part.number) != path or rows != file.metadata.num_rows:
            raise CorruptRun(
                f"{path}: says it is part {part.number} with {rows} rows, and has "
                f"{file.metadata.num_rows}; {WHAT_TO_DO}"
            )
    return part


def read_parts(store: Store) -> list[Part]:
    """Read what all parts say about themselves, and check that none is missing.

    Raises
    ------
    CorruptRun
    """
    parts = [read_part(path, store, thoroughly=False) for path in part_files(store.path)]
    there = {part.number for part in parts}
    for number in range(parts[0].count if parts else 1):
        if number not in there:
            raise CorruptRun(f"{part_path(store.path, number)}: missing; {WHAT_TO_DO}")
    return parts


def expand(store: Store, parts: Sequence[Part]) -> None:
    """Undo compaction: turn parts back into segments, show these, and delete the table.

    Parameters
    ----------
    parts
        Those that are whole. What was in others is to be computed again.

    Raises
    ------
    StorageError
        If there is no room for the segments beside the table, which stays as it is.
    """
    runs = {run.id: run for run in store.spec.runs()}
    for part in parts:
        with parquet_file(part.path, WHAT_TO_DO) as (file, _):
            table = file.read(use_threads=False)
        first_row = 0
        for segment in part.segments:
            rows = table.slice(first_row, segment.rows)
            first_row += segment.rows
            header = {"schema": SEGMENT_SCHEMA, "spec": store.spec.hash, **segment.to_dict()}
            content = encode([rows], table.schema.remove_metadata(), header)
            path = segment_path(store.folder_of(runs[segment.run]), segment.first_step)
            store_content(path, content)
    show(store.path, SEGMENTS)
    delete_table(store.path)
