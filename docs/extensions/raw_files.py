"""Copying of files that are referenced in raw HTML, which Sphinx does not parse."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

FILES = ("library/*.svg",)


def copy(app: Sphinx, failed: Exception | None) -> None:
    """Copy the files to the built site."""
    if failed or app.builder.format != "html":
        return
    for path in (each for pattern in FILES for each in Path(app.srcdir).glob(pattern)):
        target = Path(app.outdir) / path.relative_to(app.srcdir)
        target.parent.mkdir(exist_ok=True)
        shutil.copy(path, target)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect the copying to the end of the build, before links are checked."""
    app.connect("build-finished", copy, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
