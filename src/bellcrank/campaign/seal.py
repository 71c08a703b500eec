"""One checksum over every byte of a Parquet file, kept inside it.

Parquet checks its pages but not its footer, where offsets, statistics and our header are. A
seal is the SHA-256 of the whole file with the seal itself replaced by zeros.
"""

from __future__ import annotations

import hashlib
import struct
from typing import TYPE_CHECKING

from bellcrank.errors import CorruptRun

if TYPE_CHECKING:
    from pathlib import Path

SEAL_KEY = "bellcrank.seal"
BLANK = "0" * 64
"""What stands under `SEAL_KEY` while the file is being made."""
MAGIC = b"PAR1"
TAIL = 8
"""The last bytes of a Parquet file: the length of its footer, and `MAGIC`."""


def sealed(content: bytes) -> bytes:
    """Return the bytes of a Parquet file with its blank seal filled in."""
    start = _seal_start(content)
    if start is None or content[start : start + 64] != BLANK.encode():
        raise ValueError("the file has no blank seal")
    digest = hashlib.sha256(content).hexdigest().encode()
    return content[:start] + digest + content[start + 64 :]


def check_seal(path: Path, content: bytes, what_to_do: str) -> None:
    """Check that no byte of a file has changed since it was sealed.

    Raises
    ------
    CorruptRun
        If one has; `what_to_do` ends the message.
    """
    if content[:4] != MAGIC or content[-4:] != MAGIC:
        raise CorruptRun(f"{path}: damaged (truncated, or not a Parquet file); {what_to_do}")
    start = _seal_start(content)
    if start is None:
        raise CorruptRun(f"{path}: damaged (it has no seal); {what_to_do}")
    digest = hashlib.sha256(content[:start])
    digest.update(BLANK.encode())
    digest.update(content[start + 64 :])
    if digest.hexdigest().encode() != content[start : start + 64]:
        raise CorruptRun(f"{path}: damaged (its checksum does not match); {what_to_do}")


def _seal_start(content: bytes) -> int | None:
    """Return where in the footer the seal begins, behind its key and two bytes of framing."""
    (length,) = struct.unpack("<I", content[-TAIL:-4])
    key = content.find(SEAL_KEY.encode(), max(0, len(content) - TAIL - length))
    start = key + len(SEAL_KEY) + 2
    return None if key < 0 or start + 64 > len(content) else start
