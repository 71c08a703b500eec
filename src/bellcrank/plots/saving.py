"""Writing of pictures: format by suffix, atomic, without overwriting by default."""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.model.storage import already_exists, write_bytes
from bellcrank.plots.style import DPI

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Without dates, equal pictures are equal files (except for random ids in SVG, which only a
# global setting of matplotlib makes constant).
FORMATS: dict[str, dict[str, Any]] = {
    ".png": {},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}
"""Suffixes of pictures, with the metadata to omit."""


def check_target(path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Check before any computation that a picture can be written.

    Raises
    ------
    InvalidSettings
        If the suffix is not png, svg or pdf.
    OutputExists
        If the file exists and `overwrite` is not set.

    Examples
    --------
    >>> check_target("motion.jpg")
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidSettings: motion.jpg: expected a picture name ending in .png, .svg, .pdf
    """
    target = Path(path)
    if target.suffix.lower() not in FORMATS:
        raise InvalidSettings(f"{target}: expected a picture name ending in {', '.join(FORMATS)}")
    if not overwrite and os.path.lexists(target):
        raise already_exists(target)
    return target


def save_figure(figure: Figure, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a figure at 200 dots per inch, completely or not at all.

    Raises
    ------
    InvalidSettings, OutputExists
        As `check_target`.
    StorageError
        If the file cannot be written.
    """
    target = check_target(path, overwrite=overwrite)
    suffix = target.suffix.lower()
    content = BytesIO()
    figure.savefig(content, format=suffix[1:], dpi=DPI, metadata=FORMATS[suffix], facecolor="white")
    write_bytes(target, content.getvalue(), overwrite=overwrite)
