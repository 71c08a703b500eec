"""Where a study works: a folder in which every piece of work is kept, and done only once."""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import CorruptRun
from bellcrank.model.storage import write_text
from bellcrank.search import default_workers
from bellcrank.storage.files import make_folder

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    Work = Callable[[], Any]

RAW = "raw"


def silent(_what: str, _done: int, _total: int) -> None:
    """Tell nobody."""


@dataclass(frozen=True, slots=True)
class Bench:
    """A folder with what was computed so far for one study with certain settings.

    Parameters
    ----------
    folder
        Of raw records, one file each.
    workers
        Pieces of work done at the same time.
    tell
        Called with what is at hand, how many of its pieces are done, and of how many.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     bench = Bench.in_folder(Path(place), "doubling", {"times": 2})
    ...     bench.all("double", {str(k): lambda k=k: 2 * k for k in range(3)})
    ...     bench.one("double-1", lambda: "never asked")
    {'0': 0, '1': 2, '2': 4}
    2
    """

    folder: Path
    workers: int = 1
    tell: Callable[[str, int, int], None] = silent

    @classmethod
    def in_folder(
        cls,
        place: Path,
        name: str,
        settings: Any,
        workers: int | None = None,
        tell: Callable[[str, int, int], None] = silent,
    ) -> Bench:
        """Return the bench of a study; other settings have another folder beside it.

        Parameters
        ----------
        place
            Folder of all studies.
        name
            Of the study.
        settings
            A dataclass, or plain data.
        """
        key = digest(settings if isinstance(settings, dict) else asdict(settings))
        folder = place / RAW / f"{name}-{key}"
        make_folder(folder)
        return cls(folder, workers or default_workers(), tell)

    def one(self, name: str, work: Work) -> Any:
        """Return what a piece of work gives: from its file, or by doing it.

        Raises
        ------
        CorruptRun
            If the file is damaged.
        StorageError
            If it cannot be written.
        """
        path = self.folder / f"{name}.json"
        if not path.exists():
            write_text(path, json.dumps(work()), overwrite=True)
        try:
            return json.loads(path.read_text(encoding="utf-8"))
        except ValueError:
            raise CorruptRun(f"{path}: expected JSON; delete it to have it made again") from None

    def all(
        self, what: str, work: Mapping[str, Work], *, workers: int | None = None
    ) -> dict[str, Any]:
        """Do many pieces of work side by side, in threads; what is kept is not done again.

        Parameters
        ----------
        what
            They are; their files are named after it.
        work
            By names.
        workers
            At most so many at a time.
        """
        found: dict[str, Any] = {}
        self.tell(what, 0, len(work))

        def do(name: str, piece: Work) -> None:
            found[name] = self.one(f"{what}-{name}", piece)
            self.tell(what, len(found), len(work))

        with ThreadPoolExecutor(workers or self.workers) as pool:
            futures = [pool.submit(do, name, piece) for name, piece in work.items()]
            try:
                wait(futures, return_when=FIRST_EXCEPTION)
            finally:
                pool.shutdown(wait=True, cancel_futures=True)
        for future in futures:
            if not future.cancelled():
                future.result()
        return {name: found[name] for name in work}


def digest(settings: Mapping[str, Any]) -> str:
    """Return what tells settings from others, in eight digits."""
    text = json.dumps(settings, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:8]
