"""Commands whose code is in the source repository and not in the installed package."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import bellcrank
from bellcrank.errors import InvalidSettings

PACKAGE = "reproduction"


def require_reproduction() -> None:
    """Make the package `reproduction` importable.

    It is looked for on the import path, in the current folder, and beside the sources of an
    editable installation.

    Raises
    ------
    InvalidSettings
        If it is in none of these places.
    """
    if importlib.util.find_spec(PACKAGE) is not None:
        return
    for root in (Path.cwd(), Path(bellcrank.__file__).parents[2]):
        if (root / PACKAGE / "__init__.py").is_file():
            sys.path.insert(0, str(root))
            return
    raise InvalidSettings(
        "this command needs the folder reproduction/ of the source repository: "
        "run it in a checkout of bellcrank"
    )
