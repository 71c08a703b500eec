"""The store of a campaign: a folder that many processes write to and that survives them.

What lies in the folder is the only truth. Nobody needs to know about anybody else: a segment
written twice is the same to the last byte, and takes its name once.
"""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.layout import (
    DESCRIPTION,
    SEGMENTS,
    TABLE,
    part_files,
    prepare_folder,
    segment_files,
    segment_path,
    shown,
)
from bellcrank.campaign.segments import Segment, read_segment, segment_content, store_content
from bellcrank.campaign.spec import Spec
from bellcrank.errors import CorruptRun, InvalidFile, InvalidSettings, OutputExists
from bellcrank.model.parsing import read_json
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.storage.description import first_difference, plain
from bellcrank.storage.records import checked_proposals

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from bellcrank.campaign.spec import Run, Task
    from bellcrank.storage import ProposalColumns

CAMPAIGN_SCHEMA = "bellcrank/campaign/1"


class Store:
    """A campaign on disk. Made by `create` or `open`, not directly.

    Parameters
    ----------
    path
        Of the folder, absolute.
    spec
        What its ``campaign.json`` says.
    provenance
        Versions, machine and time of its start.
    """

    __slots__ = ("path", "provenance", "spec")

    def __init__(self, path: Path, spec: Spec, origin: dict[str, Any]) -> None:
        self.path = path
        self.spec = spec
        self.provenance = origin

    @classmethod
    def create(cls, path: str | os.PathLike[str], spec: Spec) -> Store:
        """Begin a campaign in a new or empty folder, or open the same one if it is there.

        Raises
        ------
        OutputExists
            If something else lies there.
        InvalidSettings
            If another campaign lies there; says where they differ.
        StorageError
            If the folder cannot be made or written.
        """
        folder = Path(path).absolute()
        if not (folder / DESCRIPTION).exists():
            prepare_folder(folder)
            data = {
                "schema": CAMPAIGN_SCHEMA,
                "hash": spec.hash,
                "provenance": provenance(),
                **spec.to_dict(),
            }
            with suppress(OutputExists):  # another process of the same campaign was faster
                write_text(folder / DESCRIPTION, json.dumps(data, indent=1) + "\n")
        store = cls.open(folder)
        if difference := changed(store.spec, spec):
            raise InvalidSettings(
                f"{folder}: the campaign there has another spec: {difference}; undo the change, "
                f"or choose another folder (--out)"
            )
        return store

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Store:
        """Open the campaign in a folder, to read it or to go on with it.

        Raises
        ------
        InvalidFile
            If there is no such folder, or no campaign in it.
        CorruptRun
            If its description is damaged or was changed.
        """
        folder = Path(path).absolute()
        file = folder / DESCRIPTION
        if not folder.is_dir():
            raise InvalidFile(f"{path}: no such folder; expected that of a campaign")
        if not file.exists():
            raise InvalidFile(f"{path}: not the folder of a campaign: it has no {DESCRIPTION}")
        data = read_json(file)
        if data.get("schema") != CAMPAIGN_SCHEMA:
            raise InvalidFile(
                f"{file}: expected schema {CAMPAIGN_SCHEMA!r}, got {data.get('schema')!r}"
            )
        try:
            spec, origin = Spec.from_dict(data), dict(data["provenance"])
        except (KeyError, TypeError, ValueError) as error:
            raise CorruptRun(f"{file}: damaged ({error!r}); restore it from a copy") from None
        if spec.hash != data.get("hash"):
            raise CorruptRun(
                f"{file}: was changed after the campaign had begun; undo that, or start another "
                f"campaign in another folder"
            )
        return cls(folder, spec, origin)

    @property
    def compacted(self) -> bool:
        """Whether the rows are in the table: all runs are done then.

        Raises
        ------
        CorruptRun
            If the link that says so is broken.
        """
        return shown(self.path) == TABLE

    def folder_of(self, run: Run) -> Path:
        """Return where the segments of a run lie."""
        return self.path / SEGMENTS / run.id

    def files(self) -> list[Path]:
        """Return the files that hold all rows stored so far, each row once.

        Raises
        ------
        CorruptRun
            If there are files of others among them.
        """
        if self.compacted:
            return part_files(self.path)
        return [path for run in self.spec.runs() for _, path in segment_files(self.folder_of(run))]

    def segments_of(self, run: Run) -> list[Segment]:
        """Read the segments of a run, every byte of them, and check that none is missing.

        Raises
        ------
        CorruptRun
            If one is damaged, missing or not its own.
        """
        segments: list[Segment] = []
        for first_step, path in segment_files(self.folder_of(run)):
            next_step = segments[-1].last_step + 1 if segments else 0
            missing = segment_path(path.parent, next_step)
            if first_step != next_step:
                raise CorruptRun(
                    f"{missing}: missing, though later ones of its run are there; bellcrank "
                    f"campaign verify --repair deletes those, and resume computes them again"
                )
            segments.append(read_segment(path, self.spec, run, thoroughly=True))
        return segments

    def last_segment(self, run: Run) -> Segment | None:
        """Read the last segment of a run, its footer only; None before the first.

        Raises
        ------
        CorruptRun
        """
        files = segment_files(self.folder_of(run))
        if not files:
            return None
        return read_segment(files[-1][1], self.spec, run, thoroughly=False)

    def append(
        self,
        run: Run,
        first_step: int,
        rows: ProposalColumns,
        state: Mapping[str, Any],
        *,
        best: float,
        done: bool,
    ) -> Segment:
        """Add the next segment of a run. Adding it again changes nothing.

        Parameters
        ----------
        first_step
            Of the first row.
        rows
            The columns of `Proposals`.
        state
            To go on from, as plain data.
        best
            Highest efficiency of an accepted design so far.
        done
            Whether the run ends here.

        Raises
        ------
        StorageError
            If there is no room; nothing that was there is touched.
        CorruptRun
            If the segment is there with another content.
        """
        cast = checked_proposals(rows, run.task.mask_bytes)
        last_step = first_step + len(cast.efficiency) - 1
        segment = Segment(run.id, first_step, last_step, plain("state", state), best, done)
        content = segment_content(self.spec, run, segment, cast)
        store_content(segment_path(self.folder_of(run), first_step), content)
        return segment


def changed(old: Spec, new: Spec) -> str | None:
    """Say where two specs differ first, or None.

    Examples
    --------
    >>> from bellcrank.campaign.spec import Task
    >>> task = Task("t", {"beams": [[0, 1]]}, {"steps": 10}, 0, 4)
    >>> old = Spec("a", 4000, (task,))
    >>> changed(old, Spec("a", 4000, (Task("t", task.problem, {"steps": 20}, 0, 4),)))
    "task 't': settings: steps is 10 there and 20 here"
    >>> changed(old, Spec("a", 4000, (task, Task("u", task.problem, {}, 0, 4))))
    "task 'u' is not there"
    """
    if old.hash == new.hash:
        return None
    own = ({"name": spec.name, "segment": spec.segment} for spec in (old, new))
    if difference := first_difference(*own):
        return difference
    before = {task.name: task for task in old.tasks}
    after = {task.name: task for task in new.tasks}
    for name, task in after.items():
        if name not in before:
            return f"task {name!r} is not there"
        if difference := _task_difference(before[name], task):
            return f"task {name!r}: {difference}"
    gone = [name for name in before if name not in after]
    return f"task {gone[0]!r} is not here" if gone else "the tasks are in another order"


def _task_difference(old: Task, new: Task) -> str | None:
    for what in ("settings", "problem"):
        if difference := first_difference(getattr(old, what), getattr(new, what)):
            return f"{what}: {difference}"
    seeds = ({"seeds": [task.first_seed, task.last_seed]} for task in (old, new))
    return first_difference(*seeds)
