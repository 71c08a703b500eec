"""Pictures on disk: format by suffix, never over another file, never half a file."""

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

# Without dates inside, the same picture is the same file (except for the random ids in SVG,
# which only a global setting of matplotlib would fix).
FORMATS: dict[str, dict[str, Any]] = {
    ".png": {},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}
"""Suffixes of pictures, with the metadata to leave out."""


def check_target(path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Refuse a picture that could not be written anyway, before it is drawn.

    Raises
    ------
    InvalidSettings
        If the suffix is none of png, svg and pdf.
    OutputExists
        If there is something of that name and `overwrite` is not set.

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
    """Write a figure whole or not at all, at 200 dots per inch.

    Raises
    ------
    InvalidSettings
        If the suffix is none of png, svg and pdf.
    OutputExists
        If there is something of that name and `overwrite` is not set.
    StorageError
        If it cannot be written.
    """
    target = check_target(path, overwrite=overwrite)
    suffix = target.suffix.lower()
    content = BytesIO()
    figure.savefig(content, format=suffix[1:], dpi=DPI, metadata=FORMATS[suffix], facecolor="white")
    write_bytes(target, content.getvalue(), overwrite=overwrite)
