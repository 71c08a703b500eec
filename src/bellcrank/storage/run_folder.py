"""The folder of a run: several chains of proposals that survive a kill at any instant.

::

    run.json                        problem, settings, provenance, status
    segments/003/00004000.parquet   proposals of chain 3 from step 4000 on, until finished
    history.parquet                 all proposals, once finished
    .lock                           held by the process that works on the run

All other files in the folder are left alone.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import CorruptRun, InvalidSettings, OutputExists
from bellcrank.model import problem_from_dict, problem_to_dict
from bellcrank.model.storage import whole_file
from bellcrank.provenance import provenance
from bellcrank.storage.description import Description, plain, read_description, write_description
from bellcrank.storage.files import make_folder, remove_temporaries, require_new_folder
from bellcrank.storage.history import HISTORY, chain_tables, read_history, write_history
from bellcrank.storage.locking import LOCK, busy, lock_holder
from bellcrank.storage.parquet import arrays_of, parquet_file, write_sealed
from bellcrank.storage.records import COLUMNS, checked_proposals
from bellcrank.storage.segments import (
    SEGMENTS,
    Segment,
    SegmentFiles,
    proposal_schema,
    segment_table,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.storage.tables import TablePart

RUN_SCHEMA = "bellcrank/run/1"
DESCRIPTION = "run.json"
STATUSES = ("running", "stopped", "finished")
TOP_NAME = re.compile(re.escape(DESCRIPTION) + "|" + re.escape(HISTORY))
CHAIN_NAME = re.compile(r"\d{3,}")
MAX_CHAINS = np.iinfo(np.int16).max + 1

SEGMENT_ADVICE = (
    "delete the damaged and all later segments of that folder and resume: their steps are "
    "computed again"
)


def check_no_run(folder: Path) -> None:
    """Check that a folder can take a new run: it does not exist, or it is empty.

    Raises
    ------
    OutputExists
        If it is a file or not empty.
    StorageError
        If another process is working in it, or it cannot be read.
    """
    if holder := lock_holder(folder / LOCK):
        raise busy(folder, holder)
    try:
        require_new_folder(folder)
    except OutputExists as error:
        if (folder / DESCRIPTION).exists():
            raise OutputExists(f"{error}, or continue the run in it (--resume {folder})") from None
        raise


def is_unfinished_run(folder: Path) -> bool:
    """Whether a folder holds a run that has no design yet."""
    return (folder / DESCRIPTION).is_file() and not (folder / "design.json").exists()


class RunFolder:
    """A run on disk, made by `create` or `open`.

    The files are the only state, so a kill cannot make them inconsistent. Several threads may
    append at the same time, each to another chain.

    Parameters
    ----------
    path
        Path of the folder.
    description
        Content of its ``run.json``.
    problem
        Problem of that description, if known.
    """

    __slots__ = ("_description", "_files", "_problem", "path")

    def __init__(
        self, path: Path, description: Description, problem: Problem | None = None
    ) -> None:
        self.path = path
        self._description = description
        self._problem = problem
        self._files = SegmentFiles(path / SEGMENTS, description.hash, SEGMENT_ADVICE)

    @classmethod
    def create(
        cls,
        path: str | os.PathLike[str],
        problem: Problem,
        settings: Mapping[str, Any],
        *,
        notes: Mapping[str, Any] | None = None,
    ) -> RunFolder:
        """Start a run in a new or empty folder.

        Parameters
        ----------
        settings
            Plain data from which the search can be repeated.
        notes
            Further entries of the provenance.

        Raises
        ------
        OutputExists
            If the folder is not empty.
        StorageError
            If the folder cannot be written, or another process is working in it.
        InvalidSettings
            If JSON cannot represent the settings.
        """
        folder = Path(path)
        content = {
            "settings": plain("settings", settings),
            "problem": plain("problem", problem_to_dict(problem)),
        }
        origin = plain("provenance", provenance(**(notes or {})))
        description = Description(content, origin, "running")
        check_no_run(folder)
        make_folder(folder)
        remove_temporaries(folder, TOP_NAME)
        try:
            write_description(folder / DESCRIPTION, RUN_SCHEMA, description)
        except OutputExists:
            raise OutputExists(
                f"{folder}: another process has just started a run in this folder; choose "
                f"another folder (--out)"
            ) from None
        return cls(folder, description, problem)

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> RunFolder:
        """Open the run in a folder, to read or to continue it.

        Raises
        ------
        InvalidFile
            If there is no such folder, or no run in it.
        CorruptRun
            If its description or history is damaged.
        """
        folder = Path(path)
        keys = ("settings", "problem")
        description = read_description(folder / DESCRIPTION, RUN_SCHEMA, "run", keys)
        if description.status not in STATUSES:
            raise CorruptRun(
                f"{folder / DESCRIPTION}: status: expected one of {', '.join(STATUSES)}, got "
                f"{description.status!r}"
            )
        run = cls(folder, description)
        run._history()
        return run

    @property
    def problem(self) -> Problem:
        """The problem, rebuilt from ``run.json``."""
        if self._problem is None:
            source = str(self.path / DESCRIPTION)
            self._problem = problem_from_dict(self._description.content["problem"], source)
        return self._problem

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the search, as plain data."""
        return dict(self._description.content["settings"])

    @property
    def provenance(self) -> dict[str, Any]:
        """Versions, machine and time of the start of the run."""
        return dict(self._description.provenance)

    @property
    def status(self) -> str:
        """State of the run: ``running``, ``stopped`` or ``finished``."""
        return self._description.status or STATUSES[0]

    @status.setter
    def status(self, status: str) -> None:
        if status not in STATUSES:
            raise InvalidSettings(f"status: expected one of {', '.join(STATUSES)}, got {status!r}")
        if status != self.status:
            changed = replace(self._description, status=status)
            write_description(self.path / DESCRIPTION, RUN_SCHEMA, changed, overwrite=True)
            self._description = changed

    @property
    def chains(self) -> list[int]:
        """Numbers of the chains that have proposals."""
        if history := self._history():
            names = {segment.run for segment in history.segments}
        else:
            names = {name for name in self._chain_names() if self._files.listed(name)}
        return sorted(map(int, names))

    def append(self, chain: int, first_step: int, records: Any, state: Mapping[str, Any]) -> None:
        """Store the next proposals of a chain, with the state from which it continues.

        Parameters
        ----------
        chain
            Number of the chain.
        first_step
            Step of the first row: the number of proposals stored before.
        records
            Columns of `Proposals` with n >= 1 rows.
        state
            Plain data, which `progress` returns.

        Raises
        ------
        StorageError
            If the folder cannot be written; what it holds stays intact.
        OutputExists
            If another process has stored these steps.
        CorruptRun
            If the rows do not follow the stored ones.
        InvalidSettings
            If a column has the wrong shape, or JSON cannot represent the state.
        """
        if not 0 <= chain < MAX_CHAINS:
            raise InvalidSettings(f"chain: expected 0 to {MAX_CHAINS - 1}, got {chain}")
        rows = checked_proposals(records, self._mask_bytes)
        name = _name_of(chain)
        last_step = first_step + len(rows.efficiency) - 1
        segment = Segment(name, first_step, last_step, plain("state", state))
        if self._history():
            raise CorruptRun(f"{self.path}: is finished; nothing can be added to it")
        path = self._files.path_of(name, first_step)
        make_folder(path.parent)
        if path.exists():
            raise OutputExists(f"{path}: exists already; another process may work on this run")
        last = self._files.last(name)
        if first_step != (stored := last.last_step + 1 if last else 0):
            raise CorruptRun(
                f"{path.parent}: rows from step {first_step} do not follow the {stored} stored"
            )
        schema = self._schema()
        table = segment_table(schema, {"chain": chain}, first_step, rows)
        with whole_file(path) as file:
            write_sealed(file, [table], schema, self._files.header_of(segment))

    def progress(self, chain: int) -> tuple[int, dict[str, Any] | None]:
        """Return where a chain continues, and remove the incomplete files of a killed process.

        Returns
        -------
        next_step
            Number of proposals stored so far.
        state
            State stored with the last of them; None at the start.

        Raises
        ------
        CorruptRun
            If a segment is damaged or missing.
        """
        name = _name_of(chain)
        if history := self._history():
            segments = [segment for segment in history.segments if segment.run == name]
        else:
            self._files.remove_temporaries(name)
            segments = self._files.read_all(name, thorough=False)
        return (segments[-1].last_step + 1, segments[-1].state) if segments else (0, None)

    def read(self, chain: int, columns: Sequence[str] | None = None) -> dict[str, NDArray[Any]]:
        """Return the proposals of a chain.

        Parameters
        ----------
        chain
            Number of the chain.
        columns
            Names out of `COLUMNS`; all by default.

        Returns
        -------
        dict
            (n,) arrays by column; ``mask`` is (n, ceil(M / 8)) uint8.

        Raises
        ------
        CorruptRun
            If a file is damaged.
        InvalidSettings
            If there is no such column.
        """
        import pyarrow as pa

        names = list(COLUMNS if columns is None else columns)
        if unknown := [name for name in names if name not in COLUMNS]:
            raise InvalidSettings(f"no column {unknown[0]!r}; known: {', '.join(COLUMNS)}")
        none = self._schema().empty_table().select(names)
        return arrays_of(pa.concat_tables([none, *self._tables(chain, names)]), names)

    def _tables(self, chain: int, names: list[str]) -> Iterator[Any]:
        if history := self._history():
            yield from chain_tables(history.path, chain, names)
            return
        for segment in self._files.read_all(_name_of(chain), thorough=False):
            path = self._files.path_of(segment.run, segment.first_step)
            with parquet_file(path, SEGMENT_ADVICE) as (file, _):
                yield file.read(columns=names, use_threads=False)

    def finish(self) -> None:
        """Merge all chains into ``history.parquet``, delete the segments, mark as finished.

        After a kill it can be repeated.

        Raises
        ------
        CorruptRun
            If a segment is damaged or missing; all segments are then left as they are.
        StorageError
            If there is no space for the history beside the segments.
        """
        remove_temporaries(self.path, TOP_NAME)
        if self._history() is None:
            self.copy_history(self.path)
        # First the segments: on a full disk this frees the space that the description needs.
        self._files.delete(self._chain_names())
        self.status = "finished"

    def copy_history(self, folder: Path) -> None:
        """Write the proposals made so far as ``history.parquet`` of another folder.

        The run must not be running meanwhile; it is not changed.

        Raises
        ------
        CorruptRun
            If a segment is damaged or missing.
        StorageError
            If there is no space for it.
        """
        names = map(_name_of, self.chains)
        segments = [each for name in names for each in self._files.read_all(name, thorough=True)]
        write_history(folder, self._files, segments, self._description, self._schema())

    def _schema(self) -> Any:
        import pyarrow as pa

        return proposal_schema({"chain": pa.int16()}, self._mask_bytes)

    def _chain_names(self) -> list[str]:
        """Return the names of the folders of chains."""
        return [name for name in self._files.runs() if CHAIN_NAME.fullmatch(name)]

    @property
    def _mask_bytes(self) -> int:
        """Bytes of a packed mask over the beams of the problem."""
        return (len(self._description.content["problem"]["beams"]) + 7) // 8

    def _history(self) -> TablePart | None:
        return read_history(self.path, self._description.hash)


def _name_of(chain: int) -> str:
    """Return the name of the folder of a chain."""
    return f"{chain:03d}"
