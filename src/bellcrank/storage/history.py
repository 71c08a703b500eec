"""The history: all proposals of a finished run in one Parquet file.

Rows are sorted by chain and step, and no row group holds more than one chain, so that a
chain is read without touching the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import CorruptRun
from bellcrank.storage.files import whole_file
from bellcrank.storage.layout import HISTORY
from bellcrank.storage.shards import (
    Shard,
    arrays_of,
    arrow_schema,
    parquet_file,
    parquet_writer,
    read_shard,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.storage.description import Description

HISTORY_SCHEMA = "bellcrank/history/1"
ROW_GROUP = 65_536
"""Rows that are written together: enough to compress well, few enough to hold in memory."""

DAMAGED_HISTORY = (
    "if the folder chains/ still holds the shards, delete it and resume; else restore it "
    "from a copy, or run again with the same seed, which gives the same result"
)


@dataclass(frozen=True, slots=True)
class History:
    """The footer of a history.

    Parameters
    ----------
    path
        Of the file.
    chains
        For each chain, the number of its steps and its last state.
    """

    path: Path
    chains: dict[int, tuple[int, dict[str, Any]]]

    def batches(self, chain: int, columns: Sequence[str]) -> Iterator[dict[str, NDArray[Any]]]:
        """Yield the rows of one chain, one row group at a time.

        Raises
        ------
        CorruptRun
        """
        with parquet_file(self.path, DAMAGED_HISTORY) as (file, _):
            order = file.schema_arrow.get_field_index("chain")
            for group in range(file.metadata.num_row_groups):
                # A row group holds one chain, so its smallest number is that of all its rows.
                if file.metadata.row_group(group).column(order).statistics.min == chain:
                    table = file.read_row_group(group, columns=list(columns), use_threads=False)
                    yield arrays_of(table, columns)


def read_history(folder: Path, spec: str) -> History | None:
    """Read the footer of the history in the folder of a run; None if there is none yet.

    Raises
    ------
    CorruptRun
        If it is damaged or that of another run.
    """
    path = folder / HISTORY
    if not path.exists():
        return None
    with parquet_file(path, DAMAGED_HISTORY) as (file, header):
        if header["spec"] != spec:
            raise CorruptRun(f"{path}: was made for another problem or with other settings")
        chains = {
            int(chain): (int(entry["steps"]), entry["state"])
            for chain, entry in header["chains"].items()
        }
        rows = sum(steps for steps, _ in chains.values())
        if rows != file.metadata.num_rows:
            raise CorruptRun(
                f"{path}: says it holds {rows} proposals and has {file.metadata.num_rows}; "
                f"{DAMAGED_HISTORY}"
            )
    return History(path, chains)


def write_history(
    folder: Path, description: Description, chains: Mapping[int, Sequence[Shard]]
) -> None:
    """Merge all shards into the history, holding little more than one row group in memory.

    Raises
    ------
    CorruptRun
        If a shard turns out to be damaged; the history is then not written.
    StorageError
        If there is no room for it; the shards stay as they are.
    """
    import pyarrow as pa

    header = {
        "schema": HISTORY_SCHEMA,
        "spec": description.spec,
        "settings": description.settings,
        "provenance": description.provenance,
        "problem": description.problem,
        "chains": {
            str(chain): {"steps": shards[-1].last_step + 1, "state": shards[-1].state}
            for chain, shards in chains.items()
        },
    }
    columns = arrow_schema(pa.binary(description.mask_bytes))
    schema = columns.insert(0, pa.field("chain", pa.int16()))
    with (
        whole_file(folder / HISTORY) as file,
        parquet_writer(file, schema, header) as writer,
    ):
        for chain, shards in sorted(chains.items()):
            for table in _row_groups(shards):
                numbers = np.full(table.num_rows, chain, dtype=np.int16)
                numbered = table.add_column(0, "chain", pa.array(numbers))
                writer.write_table(numbered.select(schema.names), row_group_size=ROW_GROUP)


def _row_groups(shards: Sequence[Shard]) -> Iterator[Any]:
    """Yield the rows of consecutive shards of one chain as tables of about `ROW_GROUP` rows."""
    import pyarrow as pa

    waiting: list[Any] = []
    for shard in shards:
        waiting.append(read_shard(shard))
        if sum(table.num_rows for table in waiting) >= ROW_GROUP:
            yield pa.concat_tables(waiting)
            waiting = []
    if waiting:
        yield pa.concat_tables(waiting)
