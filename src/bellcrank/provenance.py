"""Provenance of results: versions, commit, machine and time.

It contains no names of users or folders, so that results can be published unchanged.
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
    """Return the versions, commit, machine and time of a result made now.

    Parameters
    ----------
    **extra
        Further entries, such as seed, tolerances or wall time, stored as given.

    Returns
    -------
    dict
        Plain data for JSON. Unknown values are None; no exception is raised.

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


def other_version(recorded: Mapping[str, Any]) -> str | None:
    """Return the version that a result was started with if it differs from the current one.

    Parameters
    ----------
    recorded
        Provenance stored with the result.

    Examples
    --------
    >>> other_version(provenance())
    >>> other_version({"version": "0.0.1", "commit": None})
    '0.0.1'
    """
    now = provenance()
    keys = ("version", "commit")
    if all(recorded.get(key) == now[key] for key in keys):
        return None
    return " ".join(str(recorded[key]) for key in keys if recorded.get(key)) or "unknown"


def _version(package: str) -> str | None:
    """Return the version of an installed package without importing it."""
    with contextlib.suppress(metadata.PackageNotFoundError):
        return metadata.version(package)
    return None


def _commit() -> str | None:
    """Return the commit of the checkout of this file, or of the installed distribution."""
    # Results are stored even if the checkout or installation is damaged.
    with contextlib.suppress(OSError, ValueError, LookupError):
        return _commit_of_checkout(Path(__file__).resolve().parents[2])
    with contextlib.suppress(OSError, ValueError, LookupError, AttributeError):
        origin = metadata.distribution("bellcrank").read_text("direct_url.json")
        return str(json.loads(origin or "{}")["vcs_info"]["commit_id"])
    return None


def _commit_of_checkout(root: Path) -> str:
    """Read the commit from the files of git, without starting git.

    Raises
    ------
    OSError, LookupError
        If `root` is not the top folder of a valid checkout.
    """
    folder = root / ".git"
    if folder.is_file():  # a linked working tree
        folder = root / folder.read_text(encoding="utf-8").removeprefix("gitdir:").strip()
    head = (folder / "HEAD").read_text(encoding="utf-8").strip()
    if not head.startswith("ref:"):
        return head
    reference = head.removeprefix("ref:").strip()
    common = folder
    if (folder / "commondir").is_file():
        common = folder / (folder / "commondir").read_text(encoding="utf-8").strip()
    for parent in (folder, common):
        if (parent / reference).is_file():
            return (parent / reference).read_text(encoding="utf-8").strip()
    for line in (common / "packed-refs").read_text(encoding="utf-8").splitlines():
        commit, _, name = line.partition(" ")
        if name == reference:
            return commit
    raise LookupError(reference)
