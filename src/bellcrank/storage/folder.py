"""The folder of a run: several chains of proposals, resumable after a kill at any instant."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import CorruptRun, InvalidSettings
from bellcrank.model import problem_from_dict
from bellcrank.provenance import provenance
from bellcrank.storage.description import (
    STATUSES,
    Description,
    describe,
    plain,
    read_description,
    require_same,
    write_description,
)
from bellcrank.storage.files import remove_temporaries
from bellcrank.storage.history import History, read_history, write_history
from bellcrank.storage.layout import (
    DESCRIPTION,
    SHARD_NAME,
    TOP_NAME,
    chain_folder,
    chain_numbers,
    claim_folder,
    delete_shards,
)
from bellcrank.storage.records import (
    ProposalColumns,
    checked_columns,
    checked_proposals,
    empty_columns,
)
from bellcrank.storage.shards import Shard, append_shard, arrays_of, read_shard, read_shards

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem

MOST_CHAINS = np.iinfo(np.int16).max + 1


class RunFolder:
    """A run on disk. Made by `create` or `open`, not directly.

    What is on disk is the only truth: nothing is cached that a kill could falsify. Chains
    may be appended to by several threads at once, each chain by one of them.

    Parameters
    ----------
    path
        Of the folder.
    description
        What its ``run.json`` says.
    problem
        The problem of that description, if it is at hand.

    Attributes
    ----------
    spec
        Identity of problem and settings, which every shard carries.
    """

    __slots__ = ("_description", "_problem", "path", "spec")

    def __init__(
        self, path: Path, description: Description, problem: Problem | None = None
    ) -> None:
        self.path = path
        self._description = description
        self._problem = problem
        self.spec = description.spec

    @classmethod
    def create(
        cls,
        path: str | os.PathLike[str],
        problem: Problem,
        settings: Mapping[str, Any],
        *,
        notes: Mapping[str, Any] | None = None,
        overwrite: bool = False,
    ) -> RunFolder:
        """Begin a run in a new or empty folder.

        Parameters
        ----------
        settings
            Plain data from which the search can be repeated.
        notes
            More to keep with the provenance.
        overwrite
            Delete the run that is there. Files that are not a run's are left alone.

        Raises
        ------
        OutputExists
            If something is there already.
        StorageError
            If the folder cannot be made or written.
        InvalidSettings
            If JSON cannot hold the settings.
        """
        folder = Path(path)
        description = describe(problem, settings, provenance(**(notes or {})))
        claim_folder(folder, overwrite=overwrite)
        write_description(folder, description)
        return cls(folder, description, problem)

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> RunFolder:
        """Open the run in a folder, to read it or to go on with it.

        Raises
        ------
        InvalidFile
            If there is no such folder, or it is not that of a run.
        CorruptRun
            If its description or history is damaged.
        """
        folder = Path(path)
        run = cls(folder, read_description(folder))
        read_history(folder, run.spec)
        return run

    @property
    def problem(self) -> Problem:
        """The problem, rebuilt from ``run.json``."""
        if self._problem is None:
            source = str(self.path / DESCRIPTION)
            self._problem = problem_from_dict(self._description.problem, source)
        return self._problem

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the search, as plain data."""
        return dict(self._description.settings)

    @property
    def provenance(self) -> dict[str, Any]:
        """Versions, machine and time of the start of the run."""
        return dict(self._description.provenance)

    @property
    def status(self) -> str:
        """How the run stands: ``running``, ``stopped`` or ``finished``."""
        return self._description.status

    @status.setter
    def status(self, status: str) -> None:
        if status not in STATUSES:
            raise InvalidSettings(f"status: expected one of {', '.join(STATUSES)}, got {status!r}")
        if status != self.status:
            changed = replace(self._description, status=status)
            write_description(self.path, changed)
            self._description = changed

    def require(
        self, problem: Problem | None = None, settings: Mapping[str, Any] | None = None
    ) -> None:
        """Refuse to go on with another problem or other settings than the run began with.

        Raises
        ------
        InvalidSettings
            Naming the first difference.
        """
        require_same(self.path, self._description, problem, settings)

    @property
    def chains(self) -> list[int]:
        """Numbers of the chains that have any proposals."""
        if history := self._history():
            return sorted(history.chains)
        return chain_numbers(self.path)

    def append(
        self, chain: int, first_step: int, records: ProposalColumns, state: Mapping[str, Any]
    ) -> None:
        """Add the next proposals of a chain, together with the state to go on from.

        Parameters
        ----------
        first_step
            Of the first row; the number of proposals stored before.
        records
            The columns of `Proposals`, n >= 1 rows.
        state
            Plain data; comes back from `progress`.

        Raises
        ------
        StorageError
            If there is no room or no right to write; nothing that was there is touched.
        OutputExists
            If another process has stored these steps.
        CorruptRun
            If the rows do not follow on those stored.
        InvalidSettings
            If a column has the wrong shape, or JSON cannot hold the state.
        """
        if not 0 <= chain < MOST_CHAINS:
            raise InvalidSettings(f"chain: expected 0 to {MOST_CHAINS - 1}, got {chain}")
        rows = checked_proposals(records, self._description.mask_bytes)
        kept = plain("state", state)
        if self._history():
            raise CorruptRun(f"{self.path}: is finished; nothing can be added to it")
        append_shard(chain_folder(self.path, chain), self.spec, chain, first_step, rows, kept)

    def progress(self, chain: int) -> tuple[int, dict[str, Any] | None]:
        """Tell where a chain has to go on, and clear away what a kill left of it.

        Returns
        -------
        next_step
            Proposals stored so far.
        state
            What was stored with the last of them; None at the start.

        Raises
        ------
        CorruptRun
            If a shard is damaged or missing.
        """
        if history := self._history():
            return history.chains.get(chain, (0, None))
        remove_temporaries(chain_folder(self.path, chain), SHARD_NAME)
        shards = self._shards(chain)
        return (shards[-1].last_step + 1, shards[-1].state) if shards else (0, None)

    def records(
        self, chain: int, columns: Sequence[str] | None = None
    ) -> Iterator[dict[str, NDArray[Any]]]:
        """Yield the proposals of a chain in order, some thousand rows at a time.

        Parameters
        ----------
        columns
            Names out of `COLUMNS`; all by default.

        Yields
        ------
        dict
            (n,) arrays by column; ``mask`` is (n, ceil(M / 8)) uint8.

        Raises
        ------
        CorruptRun
            If a file turns out to be damaged.
        InvalidSettings
            If there is no such column.
        """
        names = checked_columns(columns)
        if history := self._history():
            yield from history.batches(chain, names)
            return
        for shard in self._shards(chain):
            yield arrays_of(read_shard(shard, names), names)

    def read(self, chain: int, columns: Sequence[str] | None = None) -> dict[str, NDArray[Any]]:
        """Return the proposals of a chain at once; arguments and errors as for `records`."""
        names = checked_columns(columns)
        parts = list(self.records(chain, names))
        if not parts:
            return empty_columns(names, self._description.mask_bytes)
        return {name: np.concatenate([part[name] for part in parts]) for name in names}

    def finish(self) -> None:
        """Merge all chains into ``history.parquet``, delete the shards, mark as finished.

        May be repeated: after a kill it takes up where it was.

        Raises
        ------
        CorruptRun
            If a shard is damaged or missing; all shards are then left as they are.
        StorageError
            If there is no room for the history beside the shards.
        """
        remove_temporaries(self.path, TOP_NAME)
        if self._history() is None:
            found = {chain: self._shards(chain) for chain in self.chains}
            write_history(self.path, self._description, found)
        # The shards go first: on a full disk they make the room that the status needs.
        delete_shards(self.path)
        self.status = "finished"

    def copy_history(self, folder: Path) -> None:
        """Write the proposals made so far as ``history.parquet`` of another folder.

        For a run that rests: it stays as it is, and may go on.

        Raises
        ------
        CorruptRun
            If a shard is damaged or missing.
        StorageError
            If there is no room for it.
        """
        found = {chain: shards for chain in self.chains if (shards := self._shards(chain))}
        write_history(folder, self._description, found)

    def _history(self) -> History | None:
        return read_history(self.path, self.spec)

    def _shards(self, chain: int) -> list[Shard]:
        return read_shards(chain_folder(self.path, chain), self.spec, chain)
