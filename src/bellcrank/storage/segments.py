"""Segments: consecutive proposals of one chain in a file that is written once.

The footer of a segment names its store, run and steps, and holds the state from which the chain
continues. Rows and state thus become valid at the same instant, when the file gets its name, and
the files in its folder, with their footers, are the complete record of a chain. A table merges
many segments into one file and keeps the footers of the segments in its own footer. Runs and
campaigns store their proposals this way::

    segments/003/00004000.parquet   proposals of chain 003 from step 4000 on

The name of a folder is called `run` here: a run of a campaign, or a chain of a run folder.
"""

from __future__ import annotations

import contextlib
import re
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import CorruptRun
from bellcrank.storage.files import remove_files, remove_temporaries, target_of
from bellcrank.storage.parquet import ROW_GROUP, check_seal, parquet_file

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from bellcrank.storage.records import Proposals

SEGMENTS = "segments"
"""Name of the folder of the segments."""
SEGMENT_SCHEMA = "bellcrank/segment/1"
SEGMENT_NAME = re.compile(r"\d{8,}\.parquet")


@dataclass(frozen=True, slots=True)
class Segment:
    """Footer of a segment.

    Parameters
    ----------
    run
        Name of the folder that it belongs to: a run of a campaign, or a chain of a run folder.
    first_step, last_step
        Steps of its first and last row, from 0; both are included.
    state
        State of the chain after its last row.
    best
        Highest efficiency of an accepted design so far, if the store keeps it.
    done
        Whether the chain ends with it.
    """

    run: str
    first_step: int
    last_step: int
    state: dict[str, Any]
    best: float | None = None
    done: bool = False

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.last_step - self.first_step + 1

    def to_dict(self) -> dict[str, Any]:
        """Return the footer as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Segment:
        """Rebuild the footer from plain data, which may hold more."""
        best = data["best"]
        return cls(
            str(data["run"]),
            int(data["first_step"]),
            int(data["last_step"]),
            data["state"],
            None if best is None else float(best),
            bool(data["done"]),
        )


def proposal_schema(keys: Mapping[str, Any], mask_bytes: int) -> Any:
    """Return the Arrow schema of a store.

    Parameters
    ----------
    keys
        Arrow types of the columns that name the run; they come first.
    mask_bytes
        Width of the column of masks.
    """
    import pyarrow as pa

    return pa.schema(
        {
            **keys,
            "step": pa.int64(),
            "mask": pa.binary(mask_bytes),
            **dict.fromkeys(("efficiency", "cost", "temperature"), pa.float64()),
            "accepted": pa.bool_(),
            "status": pa.int8(),
        }
    )


def segment_table(schema: Any, keys: Mapping[str, Any], first_step: int, rows: Proposals) -> Any:
    """Return proposals as an Arrow table.

    Parameters
    ----------
    schema
        Schema of the store.
    keys
        Values of the columns that name the run.
    first_step
        Step of the first row.
    rows
        Proposals of one chain; masks shorter than those of the schema are padded with zeros.
    """
    import pyarrow as pa

    count, width = rows.mask.shape
    masks = np.zeros((count, schema.field("mask").type.byte_width), dtype=np.uint8)
    masks[:, :width] = rows.mask
    buffers = [None, pa.py_buffer(masks)]
    columns = {
        **{name: pa.repeat(pa.scalar(value, schema.field(name).type), count)
           for name, value in keys.items()},
        "step": np.arange(first_step, first_step + count, dtype=np.int64),
        "mask": pa.Array.from_buffers(schema.field("mask").type, count, buffers),
        **{name: getattr(rows, name) for name in schema.names[len(keys) + 2 :]},
    }  # fmt: skip
    return pa.table(columns, schema=schema)


@dataclass(frozen=True, slots=True)
class SegmentFiles:
    """The segments of a store, in one folder for each run or chain.

    Parameters
    ----------
    root
        Folder of the segments.
    store
        Hash that identifies the store; every segment carries it.
    advice
        How to recover from a damaged or missing segment; ends those messages. Errors of files
        that do not belong to the store have a text of their own.
    exclusive
        Whether other files in these folders are errors; otherwise they are ignored.
    """

    root: Path
    store: str
    advice: str
    exclusive: bool = False

    def folder_of(self, run: str) -> Path:
        """Return the folder of the segments of a run."""
        return self.root / run

    def path_of(self, run: str, first_step: int) -> Path:
        """Return the path of the segment that begins with `first_step`."""
        return self.root / run / f"{first_step:08d}.parquet"

    def listed(self, run: str) -> list[tuple[int, Path]]:
        """Return first step and path of each segment of a run, in order.

        Raises
        ------
        CorruptRun
            If there are other files and the folder is exclusive.
        """
        found = our_files(self.folder_of(run), SEGMENT_NAME, exclusive=self.exclusive)
        return sorted((int(path.stem), path) for path in found)

    def runs(self) -> list[str]:
        """Return the names of all runs that have a folder, in order.

        Raises
        ------
        CorruptRun
            If there is a file among the folders and the folder is exclusive.
        """
        found = sorted(self.root.iterdir()) if self.root.is_dir() else []
        if self.exclusive and (files := [path for path in found if not path.is_dir()]):
            raise foreign(files[0])
        return [path.name for path in found if path.is_dir()]

    def header_of(self, segment: Segment) -> dict[str, Any]:
        """Return the header: the plain data stored in the Parquet footer of a segment."""
        return {"schema": SEGMENT_SCHEMA, "store": self.store, **segment.to_dict()}

    def read(self, run: str, path: Path, *, thorough: bool) -> Segment:
        """Read the footer of a segment and check it.

        It must belong to the store and to this folder and file name, and the file must have as
        many rows as steps.

        Parameters
        ----------
        thorough
            Whether to check every byte of the file, not only the footer.

        Raises
        ------
        CorruptRun
        """
        if thorough:
            check_seal(path, self.advice)
        with parquet_file(path, self.advice) as (file, header):
            check_header(path, header, SEGMENT_SCHEMA, self.store)
            segment = Segment.from_dict(header)
            rows = file.metadata.num_rows
            in_place = self.path_of(segment.run, segment.first_step) == self.root / run / path.name
            if not in_place or segment.rows != rows or not rows:
                raise CorruptRun(
                    f"{path}: contains steps {segment.first_step} to {segment.last_step} of run "
                    f"{segment.run} by its footer, and has {rows} rows; {self.advice}"
                )
        return segment

    def read_all(self, run: str, *, thorough: bool) -> list[Segment]:
        """Read the footers of all segments of a run and check that none is missing.

        Raises
        ------
        CorruptRun
        """
        segments: list[Segment] = []
        for first_step, path in self.listed(run):
            expected = segments[-1].last_step + 1 if segments else 0
            if first_step != expected:
                raise CorruptRun(
                    f"{self.path_of(run, expected)}: missing, although {path.name} exists; "
                    f"{self.advice}"
                )
            segments.append(self.read(run, path, thorough=thorough))
        return segments

    def last(self, run: str) -> Segment | None:
        """Read the footer of the last segment of a run; None before the first.

        Raises
        ------
        CorruptRun
        """
        files = self.listed(run)
        return self.read(run, files[-1][1], thorough=False) if files else None

    def tables(self, segments: Iterable[Segment]) -> Iterator[Any]:
        """Yield the rows of segments as Arrow tables.

        Each has at least `ROW_GROUP` rows, the last possibly fewer.

        Raises
        ------
        CorruptRun
        """
        import pyarrow as pa

        waiting: list[Any] = []
        rows = 0
        for segment in segments:
            path = self.path_of(segment.run, segment.first_step)
            with parquet_file(path, self.advice) as (file, _):
                waiting.append(file.read(use_threads=False))
            rows += segment.rows
            if rows >= ROW_GROUP:
                yield pa.concat_tables(waiting)
                waiting, rows = [], 0
        if waiting:
            yield pa.concat_tables(waiting)

    def remove_temporaries(self, run: str) -> None:
        """Remove the incomplete segments of a run that killed writers left.

        Raises
        ------
        StorageError
        """
        remove_temporaries(self.folder_of(run), SEGMENT_NAME)

    def delete(self, runs: Iterable[str]) -> None:
        """Delete all segments of some runs, complete or not, and the folders that are then empty.

        Raises
        ------
        StorageError
        """
        for run in runs:
            remove_files(self.folder_of(run), SEGMENT_NAME)
        with contextlib.suppress(OSError):
            self.root.rmdir()


def check_header(path: Path, header: Mapping[str, Any], schema: str, store: str) -> None:
    """Check that a file is of the expected kind and belongs to a store.

    Raises
    ------
    ValueError
        If it is of another kind.
    CorruptRun
        If it belongs to another store.
    """
    if header["schema"] != schema:
        raise ValueError(f"expected schema {schema!r}, got {header['schema']!r}")
    if header["store"] != store:
        raise CorruptRun(
            f"{path}: belongs to another run or campaign (another problem or other settings); "
            f"move it elsewhere"
        )


def our_files(folder: Path, ours: re.Pattern[str], *, exclusive: bool) -> list[Path]:
    """Return the files of a folder whose names match `ours`.

    Raises
    ------
    CorruptRun
        If there is another file and the folder is exclusive. Incomplete files of killed writers
        do not count.
    """
    try:
        paths = list(folder.iterdir())
    except FileNotFoundError:
        return []
    except NotADirectoryError:
        raise foreign(folder) from None
    if exclusive:
        for path in paths:
            if not ours.fullmatch(path.name) and not ours.fullmatch(target_of(path.name) or ""):
                raise foreign(path)
    return [path for path in paths if ours.fullmatch(path.name)]


def foreign(path: Path) -> CorruptRun:
    """Return the error for a file that does not belong to a store."""
    return CorruptRun(
        f"{path}: does not belong to this run or campaign; move it elsewhere, since programs that "
        f"read the folder would treat it as data"
    )
