"""Limits on the size of requests."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile
from bellcrank.model import lattices

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

BODY = 2_000_000
"""Largest size of a request, in bytes."""
MESSAGE = 2_000_000
"""Largest size of a websocket message, in bytes."""
NODES = 3000
BEAMS = 9000
STEPS = 2_000_000
CHAINS = 64
WAITING = 200
"""Largest number of queued and running searches."""


def _grid(given: Mapping[str, Any]) -> int:
    return _whole(given.get("columns")) * _whole(given.get("rows"))


def _length(value: object) -> int:
    return len(value) if isinstance(value, list) else 0


def _rows(given: Mapping[str, Any]) -> int:
    counts = given.get("counts")
    return sum(map(_whole, counts)) if isinstance(counts, list) else 0


_SIZES: dict[str, Callable[[Mapping[str, Any]], int]] = {
    "triangular-rectangle": _grid,
    "displaced-delaunay": _grid,
    "triangular-rows": _rows,
    "jammed-discs": lambda given: _whole(given.get("discs")),
    "nodes": lambda given: _length(given.get("positions")),
}
"""Estimates of the number of nodes of a lattice, by kind."""


def _whole(value: object) -> int:
    return value if isinstance(value, int) and value > 0 else 0


def check_lattice(given: object) -> None:
    """Refuse a lattice table that is too large.

    Raises
    ------
    InvalidFile
    """
    if not isinstance(given, dict):
        return
    kind = given.get("kind")
    if not isinstance(kind, str) or kind not in lattices:
        return
    if kind not in _SIZES:
        raise InvalidFile(
            f"lattice.kind: {kind!r} is not available on the page; known: {', '.join(_SIZES)}"
        )
    nodes = _SIZES[kind](given)
    if nodes > NODES:
        raise InvalidFile(f"lattice: about {nodes} nodes; the limit of the page is {NODES}")


def check_size(nodes: int, beams: int) -> None:
    """Refuse a lattice that is too large for the page.

    Raises
    ------
    InvalidFile
    """
    if nodes > NODES or beams > BEAMS:
        raise InvalidFile(
            f"lattice: {nodes} nodes and {beams} beams; "
            f"the limits of the page are {NODES} and {BEAMS}"
        )
