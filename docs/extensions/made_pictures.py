"""A scraper of sphinx-gallery for the picture files that tutorials write."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst


@dataclass
class MadePictures:
    """A scraper that shows the pictures that a block of a tutorial wrote to a folder."""

    folder: Path
    shown: set[Path] = field(default_factory=set, repr=False)

    def __call__(self, _block: Any, variables: dict[str, Any], settings: dict[str, Any]) -> str:
        """Copy new pictures to the paths that the page expects."""
        made = [path for kind in ("png", "gif") for path in sorted(self.folder.glob(f"*.{kind}"))]
        new = [path for path in made if path not in self.shown]
        copies = []
        for path, target in zip(new, variables["image_path_iterator"], strict=False):
            copy = Path(target).with_suffix(path.suffix)
            shutil.copy(path, copy)
            copies.append(str(copy))
        self.shown.update(new)
        return figure_rst(copies, settings["src_dir"]) if copies else ""
