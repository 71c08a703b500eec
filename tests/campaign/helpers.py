"""Small campaigns, and what tests compare of them."""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING, Any
from unittest import mock

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

SPEC = """
name = "small"
segment = 250

[[tasks]]
problem = "scaling-8"
search = "paper"
steps = 600
seeds = 3

[[tasks]]
name = "large"
problem = "crane"
search = "paper"
steps = 250
seeds = [7, 7]
"""
"""Four runs, ten segments, two lengths of masks."""
RUNS, SEGMENTS, ROWS = 4, 10, 3 * 600 + 250


def write_spec(folder: Path, text: str = SPEC) -> Path:
    path = folder / "spec.toml"
    path.write_text(text)
    return path


def content(folder: Path) -> dict[str, bytes]:
    """All that readers see of a store, by name."""
    shown = folder / "proposals"
    return {
        str(path.relative_to(shown)): path.read_bytes() for path in sorted(shown.rglob("*.parquet"))
    }


def everything(folder: Path) -> dict[str, bytes | str]:
    """All files of a store but its description, which holds the time; links by their target."""
    found: dict[str, bytes | str] = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_symlink():
            found[name] = str(path.readlink())
        elif path.is_file() and path.name != "campaign.json":
            found[name] = path.read_bytes()
    return found


class Killed(BaseException):
    """Stands for the end of the process."""


CALLS = ("mkdir", "fsync", "link", "replace", "unlink", "rmdir", "symlink", "open")


@contextlib.contextmanager
def killed_at(instant: int) -> Iterator[list[str]]:
    """End the process before the call to the system of that number; all later ones fail too."""
    calls: list[str] = []

    def around(name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **options: Any) -> Any:
            calls.append(name)
            if len(calls) > instant:
                raise Killed
            return real(*args, **options)

        return call

    with contextlib.ExitStack() as stack:
        for name in CALLS:
            stack.enter_context(mock.patch.object(os, name, around(name, getattr(os, name))))
        yield calls


def rotten(path: Path, offset: int) -> None:
    """Flip one bit of a file."""
    data = bytearray(path.read_bytes())
    data[offset] ^= 0x10
    path.write_bytes(data)
