"""Datasets: designs with their efficiencies by mechanics.

A dataset is one Parquet file of packed masks and efficiencies, run by run; its footer holds the
problem and the origin of the data. Designs of one run are similar, so that networks are always
tested on other runs than they are trained on.

Examples
--------
>>> from tempfile import TemporaryDirectory
>>> from pathlib import Path
>>> from bellcrank.model import find_problem
>>> crane = find_problem("crane")
>>> data = Dataset(
...     problem=crane,
...     packed=np.packbits([crane.initial] * 4, axis=1),
...     efficiency=[-0.064] * 4,
...     run=[0, 0, 1, 1],
... )
>>> with TemporaryDirectory() as folder:
...     data.write(Path(folder) / "four.parquet")
...     again = read_dataset(Path(folder) / "four.parquet")
>>> len(again), again.run_count, again.problem.name
(4, 2, 'crane')
"""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import CorruptRun, InvalidDataset, InvalidFile, first_line
from bellcrank.model import problem_from_dict, problem_to_dict
from bellcrank.model.storage import write_bytes
from bellcrank.storage.parquet import arrays_of, parquet_file, parquet_writer

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem

DATASET_FILE = "dataset.parquet"
"""Name of the dataset in the folder that it was built in."""
DATASET_SCHEMA = "bellcrank/dataset/1"
COLUMNS = ("run", "step", "mask", "efficiency", "accepted")
ROW_GROUP = 2**17
MOST = 2**31 - 1
"""Largest number of a run or a step."""
WRITER = {
    "compression": "zstd",
    "compression_level": 9,
    "use_dictionary": False,
    "column_encoding": {"efficiency": "BYTE_STREAM_SPLIT", "run": "DELTA_BINARY_PACKED",
                        "step": "DELTA_BINARY_PACKED"},
}  # fmt: skip
REMEDY = "build it again: bellcrank dataset build"


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """Designs of one problem with their efficiencies.

    Parameters
    ----------
    problem
        The problem.
    packed : (n, bytes) uint8
        Masks over the beams of the problem, as `numpy.packbits` returns them.
    efficiency : (n,) float64
        Efficiencies by mechanics; each design has a unique, stable response.
    run : (n,) int64
        Number of the run that proposed the design, from 0.
    step : (n,) int64
        Number of the proposal in its run; by default 0, 1, 2, ...
    accepted : (n,) bool
        Whether the search accepted the design; by default all.
    origin
        How the data were made, as plain data.

    Raises
    ------
    InvalidDataset
        If the dataset is empty, columns have different lengths, or a value is out of range.
    """

    problem: Problem
    packed: NDArray[np.uint8]
    efficiency: NDArray[np.float64]
    run: NDArray[np.int64]
    step: NDArray[np.int64] = field(default=None)  # type: ignore[arg-type]
    accepted: NDArray[np.bool_] = field(default=None)  # type: ignore[arg-type]
    origin: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.packed)
        given = {
            "packed": (self.packed, np.uint8),
            "efficiency": (self.efficiency, np.float64),
            "run": (self.run, np.int64),
            "step": (np.arange(count) if self.step is None else self.step, np.int64),
            "accepted": (np.ones(count) if self.accepted is None else self.accepted, np.bool_),
        }
        for name, (column, kind) in given.items():
            try:
                array: NDArray[Any] = np.array(column, dtype=kind)
            except (TypeError, ValueError, OverflowError) as error:
                raise InvalidDataset(f"{name}: {first_line(error)}") from None
            array.flags.writeable = False
            object.__setattr__(self, name, array)
            if len(array) != count or (array.ndim != 1 and name != "packed"):
                raise InvalidDataset(
                    f"{name}: expected {count} rows as in packed, got shape {array.shape}"
                )
        _check(self)

    def __len__(self) -> int:
        return len(self.packed)

    @property
    def run_count(self) -> int:
        """Number of runs."""
        return len(np.unique(self.run))

    def take(self, rows: NDArray[Any]) -> Dataset:
        """Return some of the rows, selected by index or by a boolean mask."""
        return Dataset(
            self.problem, self.packed[rows], self.efficiency[rows], self.run[rows],
            self.step[rows], self.accepted[rows], self.origin,
        )  # fmt: skip

    def write(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the Parquet file, whole or not at all.

        Raises
        ------
        OutputExists, StorageError
        """
        import pyarrow as pa

        count, width = self.packed.shape
        masks = pa.py_buffer(np.ascontiguousarray(self.packed))
        columns = {
            "run": self.run.astype(np.int32),
            "step": self.step.astype(np.int32),
            "mask": pa.Array.from_buffers(pa.binary(width), count, [None, masks]),
            "efficiency": self.efficiency,
            "accepted": self.accepted,
        }
        table = pa.table(columns)
        header = {
            "schema": DATASET_SCHEMA,
            "problem": problem_to_dict(self.problem),
            "origin": self.origin,
            "digest": _digest(self),
        }
        buffer = io.BytesIO()
        with parquet_writer(buffer, table.schema, header, **WRITER) as writer:
            writer.write_table(table, row_group_size=ROW_GROUP)
        write_bytes(path, buffer.getvalue(), overwrite=overwrite)


def join(datasets: Sequence[Dataset]) -> Dataset:
    """Return the rows of several datasets of one problem; later runs get higher numbers.

    Raises
    ------
    InvalidDataset
        If there is none, or their problems differ.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> data = Dataset(crane, np.packbits([crane.initial] * 2, axis=1), [-0.064] * 2, [0, 4])
    >>> join([data, data]).run.tolist()
    [0, 4, 5, 9]
    """
    if not datasets:
        raise InvalidDataset("no dataset is given; expected at least one")
    first, *others = datasets
    if not others:
        return first
    known = problem_to_dict(first.problem)
    for number, other in enumerate(others, 2):
        if problem_to_dict(other.problem) != known:
            raise InvalidDataset(
                f"dataset {number} has another problem ({other.problem.name!r}) than the first "
                f"({first.problem.name!r}); a network is trained on one problem"
            )
    starts = np.cumsum([0, *(int(each.run.max()) + 1 for each in datasets[:-1])])
    runs = [each.run + start for each, start in zip(datasets, starts, strict=True)]
    packed, efficiency, step, accepted = (
        np.concatenate([getattr(each, name) for each in datasets])
        for name in ("packed", "efficiency", "step", "accepted")
    )
    origin = {"joined": [each.origin for each in datasets]}
    return Dataset(first.problem, packed, efficiency, np.concatenate(runs), step, accepted, origin)


def _check(data: Dataset) -> None:
    if not len(data):
        raise InvalidDataset("the dataset is empty; expected at least one design")
    width = (data.problem.lattice.beam_count + 7) // 8
    if data.packed.shape != (len(data), width):
        raise InvalidDataset(
            f"packed: expected masks of {width} bytes for the {data.problem.lattice.beam_count} "
            f"beams of {data.problem.name!r}, got an array of shape {data.packed.shape}"
        )
    for name, column in (("run", data.run), ("step", data.step)):
        wrong = np.flatnonzero((column < 0) | (column > MOST))
        if len(wrong):
            row = int(wrong[0])
            raise InvalidDataset(f"{name}: row {row} is {column[row]}; expected 0 to {MOST}")
    wrong = np.flatnonzero(~np.isfinite(data.efficiency))
    if len(wrong):
        row = int(wrong[0])
        raise InvalidDataset(
            f"efficiency: row {row} (run {data.run[row]}, step {data.step[row]}) is "
            f"{data.efficiency[row]}; leave out designs without a unique response"
        )


def read_dataset(path: str | os.PathLike[str]) -> Dataset:
    """Read a dataset.

    Raises
    ------
    InvalidFile
        If there is no such file, or it is not a dataset.
    CorruptRun
        If it is damaged.
    InvalidDataset
        If its values are invalid.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    source = Path(path)
    if source.is_dir() and (source / DATASET_FILE).exists():
        source /= DATASET_FILE
    if source.is_dir():
        raise InvalidFile(f"{path}: no {DATASET_FILE} in this folder")
    if not source.is_file():
        raise InvalidFile(f"{path}: no such file; build a dataset with: bellcrank dataset build")
    try:
        named = pq.read_schema(source).names
    except (OSError, pa.ArrowException, ValueError) as error:
        raise InvalidFile(
            f"{source}: not a Parquet file, or damaged ({first_line(error)})"
        ) from None
    if missing := [name for name in COLUMNS if name not in named]:
        raise InvalidFile(
            f"{source}: not a dataset: it has no column {missing[0]!r}; build one with: bellcrank "
            f"dataset build"
        )
    with parquet_file(source, REMEDY) as (file, header):
        if header.get("schema") != DATASET_SCHEMA:
            raise CorruptRun(
                f"{source}: expected schema {DATASET_SCHEMA!r}, got {header.get('schema')!r}"
            )
        columns = arrays_of(file.read(columns=list(COLUMNS)), COLUMNS)
        data, origin = header["problem"], dict(header["origin"])
    problem = problem_from_dict(data, str(source))
    try:
        found = Dataset(
            problem, columns["mask"], columns["efficiency"], columns["run"], columns["step"],
            columns["accepted"], origin,
        )  # fmt: skip
    except InvalidDataset as error:
        raise InvalidDataset(f"{source}: {error}") from None
    # Parquet has checksums of its pages, but not of its footer, which lists the rows.
    if header.get("digest") not in (None, _digest(found)):
        raise CorruptRun(f"{source}: damaged (the checksum of its rows is wrong)")
    return found


def _digest(data: Dataset) -> str:
    """Return a checksum of all columns."""
    digest = hashlib.sha256()
    for column in (data.packed, data.efficiency, data.run, data.step, data.accepted):
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()
