"""Segments: the rows of some thousand steps of one run, and the state to go on from.

A segment is a sealed Parquet file that is written once. It holds no time and no name of a
machine: whoever computes it again gets the same bytes.
"""

from __future__ import annotations

import io
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.campaign.layout import segment_path
from bellcrank.campaign.seal import BLANK, SEAL_KEY, check_seal, sealed
from bellcrank.errors import CorruptRun, OutputExists
from bellcrank.search import Verdict
from bellcrank.storage.files import make_folder, storage_error, whole_file
from bellcrank.storage.shards import parquet_file, parquet_writer

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from bellcrank.campaign.spec import Run, Spec
    from bellcrank.storage import Proposals

SEGMENT_SCHEMA = "bellcrank/segment/1"
ROW_GROUP = 65_536
CONVERGED = int(Verdict.CONVERGED)
"""Status of a proposal whose efficiency is that of a stable equilibrium."""
WHAT_TO_DO = "bellcrank campaign verify --repair deletes it, and resume computes it again"

# DuckDB and polars cannot read masks split by bytes; numbers they can.
ENCODINGS = {
    "step": "DELTA_BINARY_PACKED",
    "efficiency": "BYTE_STREAM_SPLIT",
    "cost": "BYTE_STREAM_SPLIT",
}
LEVEL = 9
"""Of compression: a twentieth smaller than the usual 3, for milliseconds."""
DICTIONARIES = ["task", "run", "seed", "temperature", "status"]
STATISTICS = ["task", "run", "seed", "step", "efficiency"]
"""Columns by which readers may skip what they do not look for."""


@dataclass(frozen=True, slots=True)
class Segment:
    """What a segment says about itself.

    Parameters
    ----------
    run
        Id of its run.
    first_step, last_step
        Of its rows, both included.
    state
        Of the chain after its last row.
    best
        Highest efficiency of an accepted design so far.
    done
        Whether the chain ends with it.
    """

    run: str
    first_step: int
    last_step: int
    state: dict[str, Any]
    best: float
    done: bool

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.last_step - self.first_step + 1

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)


def table_schema(mask_bytes: int) -> Any:
    """Return the columns of every file of a store, in order, with their Arrow types."""
    import pyarrow as pa

    return pa.schema(
        {
            "task": pa.string(),
            "run": pa.string(),
            "seed": pa.int64(),
            "step": pa.int64(),
            "mask": pa.binary(mask_bytes),
            "efficiency": pa.float64(),
            "cost": pa.float64(),
            "temperature": pa.float64(),
            "accepted": pa.bool_(),
            "status": pa.int8(),
        }
    )


def encode(tables: Iterable[Any], schema: Any, header: Mapping[str, Any]) -> bytes:
    """Return the bytes of a sealed Parquet file.

    Parameters
    ----------
    tables
        The row groups.
    """
    buffer = io.BytesIO()
    with parquet_writer(
        buffer,
        schema,
        header,
        compression_level=LEVEL,
        column_encoding=ENCODINGS,
        use_dictionary=DICTIONARIES,
        write_statistics=STATISTICS,
    ) as writer:
        writer.add_key_value_metadata({SEAL_KEY: BLANK})
        for table in tables:
            writer.write_table(table, row_group_size=ROW_GROUP)
    return sealed(buffer.getvalue())


def segment_content(spec: Spec, run: Run, segment: Segment, rows: Proposals) -> bytes:
    """Return the bytes of a segment's file."""
    import pyarrow as pa

    schema = table_schema(spec.mask_bytes)
    count, width = rows.mask.shape
    masks = np.zeros((count, spec.mask_bytes), dtype=np.uint8)
    masks[:, :width] = rows.mask
    columns = {
        "task": pa.repeat(pa.scalar(run.task.name), count),
        "run": pa.repeat(pa.scalar(run.id), count),
        "seed": np.full(count, run.seed, dtype=np.int64),
        "step": np.arange(segment.first_step, segment.last_step + 1, dtype=np.int64),
        "mask": pa.Array.from_buffers(
            pa.binary(spec.mask_bytes), count, [None, pa.py_buffer(masks)]
        ),
        **{name: getattr(rows, name) for name in schema.names[5:]},
    }
    header = {"schema": SEGMENT_SCHEMA, "spec": spec.hash, **segment.to_dict()}
    return encode([pa.table(columns, schema=schema)], schema, header)


def store_content(path: Path, content: bytes) -> None:
    """Write a file once; of two writers the first wins, and both must agree.

    Raises
    ------
    CorruptRun
        If the file is there with another content.
    StorageError
    """
    make_folder(path.parent)
    try:
        if not path.exists():
            with whole_file(path) as file:
                file.write(content)
            return
    except OutputExists:
        pass
    if read_content(path) != content:
        check_seal(path, read_content(path), WHAT_TO_DO)
        raise CorruptRun(
            f"{path}: is there already and holds something else than was computed now; were two "
            f"versions or kinds of machine at work on this campaign? Keep to one, and start afresh"
        )


def read_content(path: Path) -> bytes:
    """Return the bytes of a file of the store.

    Raises
    ------
    CorruptRun
        If it is gone.
    StorageError
        If it cannot be read.
    """
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise CorruptRun(f"{path}: vanished; is somebody else at work on this campaign?") from None
    except OSError as error:
        raise storage_error(path.parent, error) from error


@contextmanager
def store_file(
    path: Path, schema: str, spec: Spec, what_to_do: str, *, thoroughly: bool
) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Open a file of the store; yield it and its header.

    Parameters
    ----------
    schema
        What it must be.
    what_to_do
        If it is damaged.
    thoroughly
        Check every byte of it, not only the footer.

    Raises
    ------
    CorruptRun
        If it is damaged, something else, or belongs to another campaign.
    """
    if thoroughly:
        check_seal(path, read_content(path), what_to_do)
    with parquet_file(path, what_to_do) as (file, header):
        if header["schema"] != schema:
            raise ValueError(f"it is {header['schema']}, not {schema}")
        if header["spec"] != spec.hash:
            raise CorruptRun(f"{path}: belongs to another campaign; move it elsewhere")
        yield file, header


def read_segment(path: Path, spec: Spec, run: Run, *, thoroughly: bool) -> Segment:
    """Read what a segment says about itself, and check that it is where it belongs.

    Parameters
    ----------
    thoroughly
        Check every byte of it, not only the footer.

    Raises
    ------
    CorruptRun
    """
    opened = store_file(path, SEGMENT_SCHEMA, spec, WHAT_TO_DO, thoroughly=thoroughly)
    with opened as (file, header):
        segment = segment_from(header)
        named = (segment.run, segment_path(path.parent, segment.first_step).name)
        if named != (run.id, path.name) or segment.rows != file.metadata.num_rows:
            raise CorruptRun(
                f"{path}: says it holds steps {segment.first_step} to {segment.last_step} of run "
                f"{segment.run}, and has {file.metadata.num_rows} rows; {WHAT_TO_DO}"
            )
        if segment.rows != spec.segment and not segment.done:
            raise CorruptRun(f"{path}: ends before its time; {WHAT_TO_DO}")
    return segment


def segment_from(header: Mapping[str, Any]) -> Segment:
    """Rebuild what a segment says about itself from plain data."""
    return Segment(
        str(header["run"]),
        int(header["first_step"]),
        int(header["last_step"]),
        header["state"],
        float(header["best"]),
        bool(header["done"]),
    )
