"""A folder that keeps each computed result of a study, so that it is computed only once."""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import CorruptRun
from bellcrank.model.storage import write_text
from bellcrank.processes import default_workers
from bellcrank.storage.files import make_folder

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    Computation = Callable[[], Any]
    Progress = Callable[[str, int, int], None]

RAW = "raw"


def no_progress(_activity: str, _done: int, _total: int) -> None:
    """Ignore progress reports."""


@dataclass(frozen=True, slots=True)
class ResultStore:
    """The results of one study with given settings, one JSON file each.

    Parameters
    ----------
    folder
        Folder of the files.
    workers
        Number of threads.
    progress
        Called with the current activity, the number of finished computations, and their total.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as root:
    ...     store = ResultStore.for_study(Path(root), "doubling", {"times": 2})
    ...     store.compute_all("double", {str(k): lambda k=k: 2 * k for k in range(3)})
    ...     store.compute("double-1", lambda: "not computed again")
    {'0': 0, '1': 2, '2': 4}
    2
    """

    folder: Path
    workers: int = 1
    progress: Progress = no_progress

    @classmethod
    def for_study(
        cls,
        root: Path,
        name: str,
        settings: Any,
        workers: int | None = None,
        progress: Progress = no_progress,
    ) -> ResultStore:
        """Return the store of a study; different settings have different folders.

        Parameters
        ----------
        root
            Folder of all studies.
        name
            Name of the study.
        settings
            A dataclass, or plain data.
        """
        key = digest(settings if isinstance(settings, dict) else asdict(settings))
        folder = root / RAW / f"{name}-{key}"
        make_folder(folder)
        return cls(folder, workers or default_workers(), progress)

    def compute(self, name: str, computation: Computation) -> Any:
        """Return a result from its file, or compute and store it.

        Raises
        ------
        CorruptRun
            If the file is damaged.
        StorageError
            If the file cannot be written.
        """
        path = self.folder / f"{name}.json"
        if not path.exists():
            write_text(path, json.dumps(computation()), overwrite=True)
        try:
            return json.loads(path.read_text(encoding="utf-8"))
        except ValueError:
            raise CorruptRun(
                f"{path}: expected JSON; delete the file to compute it again"
            ) from None

    def compute_all(
        self, what: str, computations: Mapping[str, Computation], *, workers: int | None = None
    ) -> dict[str, Any]:
        """Return many results by name; missing ones are computed in parallel threads.

        Parameters
        ----------
        what
            Activity, and prefix of the file names.
        computations
            Computations by name.
        workers
            Number of threads; by default that of the store.
        """
        found: dict[str, Any] = {}
        self.progress(what, 0, len(computations))

        def run(name: str, computation: Computation) -> None:
            found[name] = self.compute(f"{what}-{name}", computation)
            self.progress(what, len(found), len(computations))

        with ThreadPoolExecutor(workers or self.workers) as pool:
            futures = [pool.submit(run, name, each) for name, each in computations.items()]
            try:
                wait(futures, return_when=FIRST_EXCEPTION)
            finally:
                pool.shutdown(wait=True, cancel_futures=True)
        for future in futures:
            if not future.cancelled():
                future.result()
        return {name: found[name] for name in computations}


def digest(settings: Mapping[str, Any]) -> str:
    """Return an eight-digit hash of settings."""
    text = json.dumps(settings, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:8]
