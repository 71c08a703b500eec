"""Parquet files with a header in the footer and a checksum over every byte.

Parquet has checksums of its pages, but none of its footer, where offsets, statistics and the
header are. The seal is the SHA-256 of the whole file in which the seal itself is replaced by
zeros. Equal content gives equal bytes: a file holds no time and no name of a machine.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import struct
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import CorruptRun, first_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

HEADER_KEY = "bellcrank"
DIGEST_KEY = "bellcrank.sha256"
"""Key of the checksum of the header, which is checked whenever a file is opened."""
SEAL_KEY = "bellcrank.seal"
BLANK = b"0" * 64
"""Value under `SEAL_KEY` while the file is written."""
MAGIC = b"PAR1"
TAIL = 8
"""Length of the end of a Parquet file: the length of its footer, and `MAGIC`."""
ROW_GROUP = 65_536
"""Rows that are written together: enough to compress well, few enough to hold in memory."""

# Byte-stream-split masks would be smaller, but DuckDB and polars cannot read them. Statistics
# are kept of the columns by which readers select rows.
WRITER_OPTIONS: dict[str, Any] = {
    "compression": "zstd",
    "compression_level": 9,
    "use_dictionary": ["task", "run", "seed", "chain", "temperature", "status"],
    "column_encoding": {
        "step": "DELTA_BINARY_PACKED",
        "efficiency": "BYTE_STREAM_SPLIT",
        "cost": "BYTE_STREAM_SPLIT",
    },
    "write_statistics": ["task", "run", "seed", "chain", "step", "efficiency"],
    "store_schema": False,
    "write_page_checksum": True,
}


def write_sealed(
    file: IO[bytes], tables: Iterable[Any], schema: Any, header: Mapping[str, Any]
) -> None:
    """Write a sealed Parquet file.

    Parameters
    ----------
    file
        Open for reading and writing, empty.
    tables
        Arrow tables of the rows, in order.
    schema
        Arrow schema of the tables.
    header
        Plain data for the footer.
    """
    with parquet_writer(file, schema, header) as writer:
        writer.add_key_value_metadata({SEAL_KEY: BLANK.decode()})
        for table in tables:
            writer.write_table(table, row_group_size=ROW_GROUP)
    file.flush()
    start, digest = _seal(file)
    file.seek(start)
    file.write(digest)


def seal_of(file: IO[bytes]) -> bytes:
    """Return the seal that the content of a file requires.

    Raises
    ------
    ValueError
        If it is not a sealed Parquet file.
    """
    return _seal(file)[1]


def check_seal(path: Path, advice: str) -> bytes:
    """Check that no byte of a sealed file has changed; return the seal.

    Raises
    ------
    CorruptRun
        If a byte has changed; `advice` ends the message.
    """
    try:
        with path.open("rb") as file:
            start, digest = _seal(file)
            file.seek(start)
            found = file.read(len(BLANK))
    except FileNotFoundError:
        raise CorruptRun(f"{path}: missing; another process may have removed it") from None
    except (OSError, ValueError, struct.error) as error:
        raise CorruptRun(f"{path}: damaged ({first_line(error)}); {advice}") from None
    if found != digest:
        raise CorruptRun(f"{path}: damaged (its checksum does not match); {advice}")
    return digest


def _seal(file: IO[bytes]) -> tuple[int, bytes]:
    """Return where the seal of a file is and what it has to be."""
    file.seek(0)
    size = file.seek(0, 2)
    file.seek(max(0, size - TAIL))
    tail = file.read()
    file.seek(0)
    if tail[-4:] != MAGIC or file.read(4) != MAGIC:
        raise ValueError("truncated, or not a Parquet file")
    (length,) = struct.unpack("<I", tail[:4])
    footer = max(0, size - TAIL - length)
    file.seek(footer)
    # Two bytes of framing are between the key and its value.
    key = file.read().find(SEAL_KEY.encode())
    start = footer + key + len(SEAL_KEY) + 2
    if key < 0 or start + len(BLANK) > size:
        raise ValueError("it has no checksum")
    digest = hashlib.sha256()
    file.seek(0)
    remaining = start
    while remaining:
        digest.update(chunk := file.read(min(remaining, 2**20)))
        remaining -= len(chunk)
    digest.update(BLANK)
    file.seek(start + len(BLANK))
    while chunk := file.read(2**20):
        digest.update(chunk)
    return start, digest.hexdigest().encode()


@contextlib.contextmanager
def parquet_writer(
    file: IO[bytes], schema: Any, header: Mapping[str, Any], **options: Any
) -> Iterator[Any]:
    """Open a Parquet writer on a file, with `header` and its checksum in the footer.

    Parameters
    ----------
    **options
        Options of the writer that differ from `WRITER_OPTIONS`.
    """
    import pyarrow.parquet as pq

    with pq.ParquetWriter(file, schema, **{**WRITER_OPTIONS, **options}) as writer:
        text = json.dumps(header)
        digest = hashlib.sha256(text.encode()).hexdigest()
        writer.add_key_value_metadata({HEADER_KEY: text, DIGEST_KEY: digest})
        yield writer


@contextlib.contextmanager
def parquet_file(path: Path, advice: str) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Open a Parquet file; yield it and the header in its footer.

    Raises
    ------
    CorruptRun
        If the file is damaged, here or while it is read; `advice` ends the message.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            yield file, _header(file.metadata.metadata or {})
    except CorruptRun:
        raise
    except (OSError, pa.ArrowException, ValueError, KeyError) as error:
        raise CorruptRun(f"{path}: damaged ({first_line(error)}); {advice}") from error


def _header(metadata: Mapping[bytes, bytes]) -> dict[str, Any]:
    text = metadata.get(HEADER_KEY.encode())
    if text is None:
        raise ValueError("the header of bellcrank is missing")
    if metadata.get(DIGEST_KEY.encode()) != hashlib.sha256(text).hexdigest().encode():
        raise ValueError("its header was changed")
    header: dict[str, Any] = json.loads(text)
    return header


def arrays_of(table: Any, columns: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Return columns of an Arrow table as arrays; masks as rows of bytes.

    Raises
    ------
    ValueError
        If a value is missing, or masks are not all of one width.
    """
    return {name: _array_of(name, table.column(name)) for name in columns}


def _array_of(name: str, column: Any) -> NDArray[Any]:
    import pyarrow as pa

    if column.null_count:
        raise ValueError(f"{name}: {column.null_count} values are missing")
    if pa.types.is_binary(column.type) or pa.types.is_string(column.type):
        raise ValueError(f"{name}: expected bytes of one width, got {column.type}")
    if not pa.types.is_fixed_size_binary(column.type):
        array: NDArray[Any] = column.to_numpy()
        return array
    width = column.type.byte_width
    parts = [
        np.frombuffer(chunk.buffers()[1], dtype=np.uint8)[
            chunk.offset * width : (chunk.offset + len(chunk)) * width
        ].reshape(-1, width)
        for chunk in column.chunks
        if len(chunk)
    ]
    return np.concatenate(parts) if parts else np.empty((0, width), dtype=np.uint8)
