"""Whether two processes would compute the same."""

from __future__ import annotations

import platform
from functools import cache

from bellcrank.provenance import provenance

NAMES = ("bellcrank", "commit", "python", "numpy", "numba")
"""What has to be the same for the same results."""


@cache
def software() -> dict[str, str | None]:
    """Return the versions in this process of all that results depend on.

    Examples
    --------
    >>> list(software())
    ['bellcrank', 'commit', 'python', 'numpy', 'numba']
    """
    found = provenance()
    python = ".".join(platform.python_version_tuple()[:2])
    values = (found["version"], found["commit"], python, found["numpy"], found["numba"])
    return dict(zip(NAMES, values, strict=True))


def version_difference(ours: dict[str, str | None], theirs: dict[str, str | None]) -> str | None:
    """Say where two sets of versions differ first, or None.

    A commit that one side does not know says nothing.

    Examples
    --------
    >>> version_difference({"numpy": "2.4"}, {"numpy": "2.3"})
    'numpy 2.3 there and 2.4 here'
    """
    for name, here in ours.items():
        there = theirs.get(name)
        if here != there and not (name == "commit" and None in (here, there)):
            return f"{name} {there or 'missing'} there and {here or 'missing'} here"
    return None
