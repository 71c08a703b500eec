"""Shards: some thousand consecutive proposals of one chain in one write-once file.

The footer of a shard says which run, chain and steps it belongs to and carries the state
to go on from. Rows and state thus take effect in the same instant, when the file takes
its name, and the listing of a folder is all there is to know about a chain.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import CorruptRun, OutputExists, first_line
from bellcrank.storage.files import make_folder, whole_file
from bellcrank.storage.layout import shard_files, shard_path

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.storage.records import Proposals

SHARD_SCHEMA = "bellcrank/shard/1"
METADATA_KEY = "bellcrank"
DIGEST_KEY = "bellcrank.sha256"
"""Parquet checks its pages, but not its footer, where the state of the chain is."""

DAMAGED_SHARD = (
    "delete it and the later ones in its folder and resume: their steps are computed again"
)

# Masks change by a bit or two from row to row: byte by byte, each column of bytes is
# nearly constant. Efficiencies share their leading bytes only. Statistics serve to find
# the rows of a chain; of the other columns they would only take room.
WRITER_OPTIONS: dict[str, Any] = {
    "compression": "zstd",
    "compression_level": 3,
    "use_dictionary": ["chain", "temperature", "status"],
    "column_encoding": {
        "step": "DELTA_BINARY_PACKED",
        "mask": "BYTE_STREAM_SPLIT",
        "efficiency": "BYTE_STREAM_SPLIT",
        "cost": "BYTE_STREAM_SPLIT",
    },
    "write_statistics": ["chain", "step"],
    "store_schema": False,
    "write_page_checksum": True,
}


@dataclass(frozen=True, slots=True)
class Shard:
    """The footer of a shard.

    Parameters
    ----------
    path
        Of the file.
    first_step, last_step
        Of its rows, both included.
    state
        Of the chain after its last row.
    """

    path: Path
    first_step: int
    last_step: int
    state: dict[str, Any]


def append_shard(
    chain_folder: Path,
    spec: str,
    chain: int,
    first_step: int,
    rows: Proposals,
    state: Mapping[str, Any],
) -> None:
    """Write the next shard of a chain, whole or not at all.

    Raises
    ------
    OutputExists
        If it is there already.
    CorruptRun
        If it does not follow on the shards that are there.
    StorageError
    """
    make_folder(chain_folder)
    path = shard_path(chain_folder, first_step)
    if path.exists():
        raise OutputExists(f"{path}: exists already; is another process at work on this run?")
    stored = shard_files(chain_folder)
    end = read_footer(stored[-1][1], spec, chain).last_step + 1 if stored else 0
    if first_step != end:
        raise CorruptRun(
            f"{chain_folder}: rows from step {first_step} do not follow on the {end} stored"
        )
    header = {
        "schema": SHARD_SCHEMA,
        "spec": spec,
        "chain": chain,
        "first_step": first_step,
        "last_step": first_step + len(rows.efficiency) - 1,
        "state": state,
    }
    table = table_of(first_step, rows)
    with whole_file(path) as file, parquet_writer(file, table.schema, header) as writer:
        writer.write_table(table)


@contextlib.contextmanager
def parquet_writer(
    file: IO[bytes], schema: Any, header: Mapping[str, Any], **options: Any
) -> Iterator[Any]:
    """Open a Parquet writer on a file, with our `header` in its footer.

    Parameters
    ----------
    **options
        Of the writer, where they differ from `WRITER_OPTIONS`.
    """
    import pyarrow.parquet as pq

    with pq.ParquetWriter(file, schema, **{**WRITER_OPTIONS, **options}) as writer:
        text = json.dumps(header)
        writer.add_key_value_metadata({METADATA_KEY: text, DIGEST_KEY: _digest(text.encode())})
        yield writer


@contextlib.contextmanager
def parquet_file(path: Path, what_to_do: str) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Open a Parquet file of ours; yield it and the header in its footer.

    Raises
    ------
    CorruptRun
        If it is damaged, here or while it is being read; `what_to_do` ends the message.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            yield file, _header(file.metadata.metadata or {})
    except CorruptRun:
        raise
    except (OSError, pa.ArrowException, ValueError, KeyError) as error:
        reason = first_line(error)
        raise CorruptRun(f"{path}: damaged ({reason}); {what_to_do}") from error


def _header(metadata: Mapping[bytes, bytes]) -> dict[str, Any]:
    if METADATA_KEY.encode() not in metadata:
        raise ValueError("bellcrank's own header is missing")
    text = metadata[METADATA_KEY.encode()]
    if metadata[DIGEST_KEY.encode()] != _digest(text).encode():
        raise ValueError("its footer was changed")
    header: dict[str, Any] = json.loads(text)
    return header


def _digest(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()


def read_shards(chain_folder: Path, spec: str, chain: int) -> list[Shard]:
    """Read the footers of a chain's shards and check that they follow on one another.

    Raises
    ------
    CorruptRun
        If a shard is damaged, belongs elsewhere or is missing.
    """
    shards: list[Shard] = []
    next_step = 0
    for first_step, path in shard_files(chain_folder):
        if first_step != next_step:
            raise CorruptRun(
                f"{chain_folder}: expected a shard that begins with step {next_step}, the next "
                f"is {path.name}; restore {shard_path(chain_folder, next_step).name}, or delete "
                f"the later ones and resume: their steps are computed again"
            )
        shard = read_footer(path, spec, chain)
        shards.append(shard)
        next_step = shard.last_step + 1
    return shards


def read_footer(path: Path, spec: str, chain: int) -> Shard:
    """Read what a shard says about itself, and check it.

    Raises
    ------
    CorruptRun
    """
    with parquet_file(path, DAMAGED_SHARD) as (file, header):
        rows = file.metadata.num_rows
        if header["spec"] != spec:
            raise CorruptRun(f"{path}: was made for another problem or with other settings")
        shard = Shard(path, int(header["first_step"]), int(header["last_step"]), header["state"])
        said = (header["chain"], shard_path(path.parent, shard.first_step).name)
        if said != (chain, path.name) or shard.last_step - shard.first_step + 1 != rows or not rows:
            raise CorruptRun(
                f"{path}: says it holds steps {shard.first_step} to {shard.last_step} of chain "
                f"{header['chain']}, and has {rows} rows; {DAMAGED_SHARD}"
            )
    return shard


def read_shard(shard: Shard, columns: Sequence[str] | None = None) -> Any:
    """Read a shard, or some of its columns, as an Arrow table.

    Raises
    ------
    CorruptRun
    """
    with parquet_file(shard.path, DAMAGED_SHARD) as (file, _):
        found = file.schema_arrow.remove_metadata()
        if not found.equals(arrow_schema(found.field("mask").type)):
            raise ValueError(f"unexpected columns {', '.join(found.names)}")
        names = None if columns is None else list(columns)
        table = file.read(columns=names, use_threads=False)
        if table.num_rows != shard.last_step - shard.first_step + 1:
            raise ValueError("rows are missing")
    return table


def arrow_schema(mask_type: Any) -> Any:
    """Return the columns of a shard, in order, with their Arrow types."""
    import pyarrow as pa

    floats = dict.fromkeys(("efficiency", "cost", "temperature"), pa.float64())
    ends = {"accepted": pa.bool_(), "status": pa.int8()}
    return pa.schema({"step": pa.int64(), "mask": mask_type, **floats, **ends})


def table_of(first_step: int, rows: Proposals) -> Any:
    """Return proposals as an Arrow table."""
    import pyarrow as pa

    count, width = rows.mask.shape
    masks = pa.Array.from_buffers(pa.binary(width), count, [None, pa.py_buffer(rows.mask)])
    return pa.table(
        {
            "step": np.arange(first_step, first_step + count, dtype=np.int64),
            "mask": masks,
            "efficiency": rows.efficiency,
            "cost": rows.cost,
            "temperature": rows.temperature,
            "accepted": rows.accepted,
            "status": rows.status,
        }
    )


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
