"""Where a result comes from: versions, commit, machine and time.

Nothing in it names a person or a folder, so that results can be published as they are.
"""

from __future__ import annotations

import contextlib
import json
import platform
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


def provenance(**extra: Any) -> dict[str, Any]:
    """Describe the software and machine that a result is made with.

    Parameters
    ----------
    **extra
        What else to note about the result: seed, tolerances, wall time. Kept as given.

    Returns
    -------
    dict
        Plain data, ready for JSON. What cannot be found out is None; nothing is raised.

    Examples
    --------
    >>> note = provenance(seed=7)
    >>> note["package"], note["seed"]
    ('bellcrank', 7)
    >>> sorted(note)  # doctest: +NORMALIZE_WHITESPACE
    ['commit', 'machine', 'numba', 'numpy', 'package', 'python', 'seed', 'system', 'time',
     'version']
    """
    return {
        "package": "bellcrank",
        "version": _version("bellcrank"),
        "commit": _commit(),
        "python": platform.python_version(),
        "numpy": _version("numpy"),
        "numba": _version("numba"),
        "system": platform.system(),
        "machine": platform.machine(),
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        **extra,
    }


def other_version(begun: Mapping[str, Any]) -> str | None:
    """Return the version that something was begun with, if it is not this one.

    Parameters
    ----------
    begun
        Its `provenance`.

    Examples
    --------
    >>> other_version(provenance())
    >>> other_version({"version": "0.0.1", "commit": None})
    '0.0.1'
    """
    now = provenance()
    keys = ("version", "commit")
    if all(begun.get(key) == now[key] for key in keys):
        return None
    return " ".join(str(begun[key]) for key in keys if begun.get(key)) or "unknown"


def _version(package: str) -> str | None:
    """Version of an installed package, without importing it."""
    with contextlib.suppress(metadata.PackageNotFoundError):
        return metadata.version(package)
    return None


def _commit() -> str | None:
    """Commit of the checkout that this file lies in, or of the one it was installed from."""
    # A broken checkout or installation must not keep a result from being stored.
    with contextlib.suppress(OSError, ValueError, LookupError):
        return _commit_of_checkout(Path(__file__).resolve().parents[2])
    with contextlib.suppress(OSError, ValueError, LookupError, AttributeError):
        origin = metadata.distribution("bellcrank").read_text("direct_url.json")
        return str(json.loads(origin or "{}")["vcs_info"]["commit_id"])
    return None


def _commit_of_checkout(root: Path) -> str:
    """Read the commit from git's own files: starting git takes longer and may not work.

    Raises
    ------
    OSError, LookupError
        If `root` is not the top of a checkout, or one that git itself would not understand.
    """
    folder = root / ".git"
    if folder.is_file():  # a linked working tree points to its folder
        folder = root / folder.read_text(encoding="utf-8").removeprefix("gitdir:").strip()
    head = (folder / "HEAD").read_text(encoding="utf-8").strip()
    if not head.startswith("ref:"):
        return head
    reference = head.removeprefix("ref:").strip()
    common = folder
    if (folder / "commondir").is_file():
        common = folder / (folder / "commondir").read_text(encoding="utf-8").strip()
    for place in (folder, common):
        if (place / reference).is_file():
            return (place / reference).read_text(encoding="utf-8").strip()
    for line in (common / "packed-refs").read_text(encoding="utf-8").splitlines():
        commit, _, name = line.partition(" ")
        if name == reference:
            return commit
    raise LookupError(reference)
