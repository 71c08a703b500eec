"""The store of a campaign: a folder that many processes write to, and that survives a kill.

::

    campaign.json                                  resolved spec
    segments/3f2a91c40b77-12/00004000.parquet      proposals of one run from step 4000 on
    table/part-00000.parquet                       all proposals, once all runs are done
    proposals -> segments | table                  link for readers

The link is switched in one step, so that a reader of ``proposals/**/*.parquet`` finds each row
once at any time. ``segments`` and ``table`` may hold no other files. Writers need no
coordination: a segment that is computed twice has the same bytes, and gets its name once.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import secrets
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.spec import Spec, spec_difference
from bellcrank.errors import CorruptRun, InvalidSettings, OutputExists
from bellcrank.model.storage import storage_error, sync_folder, whole_file
from bellcrank.provenance import provenance
from bellcrank.storage.description import Description, plain, read_description, write_description
from bellcrank.storage.files import make_folder, require_new_folder
from bellcrank.storage.parquet import check_seal, seal_of, write_sealed
from bellcrank.storage.records import checked_proposals
from bellcrank.storage.segments import (
    SEGMENTS,
    Segment,
    SegmentFiles,
    our_files,
    proposal_schema,
    segment_table,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from bellcrank.campaign.spec import Run

CAMPAIGN_SCHEMA = "bellcrank/campaign/1"
DESCRIPTION = "campaign.json"
TABLE = "table"
VISIBLE = "proposals"
PART_NAME = re.compile(r"part-\d{5}\.parquet")
TOP_NAME = re.compile(re.escape(DESCRIPTION) + "|" + VISIBLE)
OURS = (DESCRIPTION, SEGMENTS, TABLE, VISIBLE)
SEGMENT_ADVICE = (
    "bellcrank campaign verify --repair deletes the damaged and all later segments of the run, "
    "and resume computes them again"
)
TABLE_ADVICE = (
    "bellcrank campaign verify --repair turns the other parts back into segments, and resume "
    "computes the rest again"
)
SPEC_KEYS = ("name", "segment", "tasks")


class Store:
    """A campaign on disk, made by `create` or `open`.

    Parameters
    ----------
    path
        Path of the folder, absolute.
    spec
        Content of its ``campaign.json``.
    origin
        Versions, machine and time of its start.

    Attributes
    ----------
    segments
        Access to its segments.
    """

    __slots__ = ("path", "provenance", "segments", "spec")

    def __init__(self, path: Path, spec: Spec, origin: dict[str, Any]) -> None:
        self.path = path
        self.spec = spec
        self.provenance = origin
        self.segments = SegmentFiles(path / SEGMENTS, spec.hash, SEGMENT_ADVICE, exclusive=True)

    @classmethod
    def create(cls, path: str | os.PathLike[str], spec: Spec) -> Store:
        """Start a campaign in a new or empty folder, or open the same one if it is there.

        Raises
        ------
        OutputExists
            If the folder holds anything else.
        InvalidSettings
            If it holds another campaign; the message names the first difference.
        StorageError
            If the folder cannot be written.
        """
        folder = Path(path).absolute()
        if not (folder / DESCRIPTION).exists():
            require_new_folder(folder, OURS.__contains__)
            make_folder(folder / SEGMENTS)
            if not os.path.lexists(folder / VISIBLE):
                switch_link(folder, SEGMENTS)
            description = Description(spec.to_dict(), provenance())
            # Another process of the same campaign may be faster.
            with contextlib.suppress(OutputExists):
                write_description(folder / DESCRIPTION, CAMPAIGN_SCHEMA, description)
        store = cls.open(folder)
        if difference := spec_difference(store.spec, spec):
            raise InvalidSettings(
                f"{folder}: the campaign in this folder has another spec: {difference}; undo the "
                f"change, or choose another folder (--out)"
            )
        return store

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Store:
        """Open the campaign in a folder, to read or to continue it.

        Raises
        ------
        InvalidFile
            If there is no such folder, or no campaign in it.
        CorruptRun
            If its description is damaged or was changed.
        """
        file = Path(path).absolute() / DESCRIPTION
        found = read_description(file, CAMPAIGN_SCHEMA, "campaign", SPEC_KEYS)
        return cls(file.parent, Spec.from_dict(found.content), found.provenance)

    @property
    def compacted(self) -> bool:
        """Whether readers see the table; all runs are done then.

        Raises
        ------
        CorruptRun
            If the link is missing or has another target.
        """
        link = self.path / VISIBLE
        target = ""
        with contextlib.suppress(OSError):
            target = str(link.readlink())
        if target not in (SEGMENTS, TABLE):
            raise CorruptRun(
                f"{link}: expected a link to {SEGMENTS} or {TABLE}; restore it with: "
                f"ln -s {SEGMENTS} {link}"
            )
        return target == TABLE

    def folder_of(self, run: Run) -> Path:
        """Return the folder of the segments of a run."""
        return self.segments.folder_of(run.id)

    def parts(self) -> list[Path]:
        """Return the parts of the table, in order.

        Raises
        ------
        CorruptRun
            If the folder holds other files.
        """
        return sorted(our_files(self.path / TABLE, PART_NAME, exclusive=True))

    def files(self) -> list[Path]:
        """Return the files that hold all stored rows, each row once.

        Raises
        ------
        CorruptRun
            If there are other files among them.
        """
        if self.compacted:
            return self.parts()
        return [path for run in self.spec.runs() for _, path in self.segments.listed(run.id)]

    @property
    def schema(self) -> Any:
        """Arrow schema of every file."""
        import pyarrow as pa

        keys = {"task": pa.string(), "run": pa.string(), "seed": pa.int64()}
        return proposal_schema(keys, self.spec.mask_bytes)

    def append(
        self,
        run: Run,
        first_step: int,
        rows: Any,
        state: Mapping[str, Any],
        *,
        best: float,
        done: bool,
    ) -> None:
        """Store the next segment of a run. Storing it again changes nothing.

        Parameters
        ----------
        run
            Run that it belongs to.
        first_step
            Step of the first row.
        rows
            Columns of `Proposals`.
        state
            State from which the chain continues, as plain data.
        best
            Highest efficiency of an accepted design so far.
        done
            Whether the run ends here.

        Raises
        ------
        StorageError
            If there is no space; stored data stays intact.
        CorruptRun
            If the segment exists with another content.
        """
        cast = checked_proposals(rows, run.task.mask_bytes)
        last_step = first_step + len(cast.efficiency) - 1
        segment = Segment(run.id, first_step, last_step, plain("state", state), best, done)
        schema = self.schema
        keys = {"task": run.task.name, "run": run.id, "seed": run.seed}
        table = segment_table(schema, keys, first_step, cast)
        path = self.segments.path_of(run.id, first_step)
        self.write(path, partial(iter, (table,)), self.segments.header_of(segment))

    def write(
        self, path: Path, tables: Callable[[], Iterable[Any]], header: Mapping[str, Any]
    ) -> None:
        """Write a file once; a second writer of the file must have the same content.

        Raises
        ------
        CorruptRun
            If the file exists with another content.
        StorageError
        """
        make_folder(path.parent)
        with contextlib.suppress(OutputExists):
            if not path.exists():
                with whole_file(path) as file:
                    write_sealed(file, tables(), self.schema, header)
                return
        computed = io.BytesIO()
        write_sealed(computed, tables(), self.schema, header)
        if check_seal(path, SEGMENT_ADVICE) != seal_of(computed):
            raise CorruptRun(
                f"{path}: exists with another content than was computed now; different versions "
                f"or kinds of machine may have worked on this campaign: use one kind, and start "
                f"the campaign anew"
            )


def switch_link(folder: Path, target: str) -> None:
    """Make ``segments`` or ``table`` visible to readers, in one step.

    Raises
    ------
    StorageError
    """
    temporary = folder / f".{VISIBLE}.{secrets.token_hex(4)}"
    try:
        temporary.symlink_to(target, target_is_directory=True)
        try:
            temporary.replace(folder / VISIBLE)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error
    sync_folder(folder)
