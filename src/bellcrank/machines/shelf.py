"""Fitted potentials that are kept between runs: fitting takes seconds, reading a millisecond.

A kept fit is named by all that it follows from: the design, the range, the degrees, and the
sources of everything that computes it. It is only ever a short cut: what is not there, or cannot be
read, is fitted again, and a folder that cannot be written keeps nothing.
"""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank import __version__
from bellcrank.errors import BellcrankError
from bellcrank.machines.record import fit_from_dict, fit_to_dict
from bellcrank.model.storage import read_text, write_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bellcrank.machines.sampling import Fit, Reach
    from bellcrank.model import Design

SOURCES = ("mechanics/**/*.py", "machines/potential.py", "machines/sampling.py")
"""What a fit follows from, besides its design and range."""


def usual_folder() -> Path:
    """Return where fits are kept: in the folder that ``BELLCRANK_CACHE`` names, or the user's."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "bellcrank"
    return Path(os.environ.get("BELLCRANK_CACHE") or base) / "potentials"


def kept_fit(
    folder: Path | None,
    design: Design,
    reach: Reach,
    degrees: Sequence[int],
    make: Callable[[], Fit],
) -> Fit:
    """Return the fit of a design over a range, from the folder or made now and kept there.

    Parameters
    ----------
    folder
        None keeps nothing.
    make
        Fits; whatever it raises comes through.
    """
    if folder is None:
        return make()
    path = folder / f"{_name(design, reach, degrees)}.json"
    with suppress(BellcrankError, ValueError):
        return fit_from_dict(json.loads(read_text(path)), str(path))
    found = make()
    with suppress(OSError, BellcrankError):
        folder.mkdir(parents=True, exist_ok=True)
        write_text(path, json.dumps(fit_to_dict(found)), overwrite=True)
    return found


def _name(design: Design, reach: Reach, degrees: Sequence[int]) -> str:
    """Return a name for all that a fit follows from; what the problem is called does not count."""
    digest = hashlib.sha256(_sources().encode())
    digest.update(replace(design.problem, name="part").hash.encode())
    digest.update(design.mask_hex.encode())
    digest.update(json.dumps(list(degrees)).encode())
    for array in (reach.prescribed, reach.axis, reach.spread):
        digest.update(np.ascontiguousarray(array).tobytes() + str(array.shape).encode())
    return digest.hexdigest()[:32]


@cache
def _sources() -> str:
    package = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256(__version__.encode())
    for pattern in SOURCES:
        for path in sorted(package.glob(pattern)):
            digest.update(path.read_bytes())
    return digest.hexdigest()
