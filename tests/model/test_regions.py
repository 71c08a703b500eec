from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem
from bellcrank.model import Lattice, lattices, regions


@pytest.fixture
def lattice() -> Lattice:
    """Rows of 3, 4, 3 and 4 nodes, numbered 0-2, 3-6, 7-9, 10-13."""
    return lattices["triangular-rectangle"](columns=3, rows=4)


@pytest.mark.parametrize(
    ("kind", "value", "options", "expected"),
    [
        ("row", 1, {}, [3, 4, 5, 6]),
        ("row", -1, {"rightmost": 2}, [12, 13]),
        ("row", -2, {"leftmost": 1}, [7]),
        ("rows", [0, -1], {}, [0, 1, 2, 10, 11, 12, 13]),
        ("rows", [0, 1], {"leftmost": 1}, [0, 3]),
        ("rows", [], {}, []),
        ("box", [0.5, 0.0, 1.5, 0.9], {}, [0, 1, 4]),
        ("box", [50, 50, 60, 60], {}, []),
        ("nearest", [2.9, 0.8], {}, [6]),
        ("nearest", [1.5, -1.0], {"count": 3}, [0, 1, 2]),
        ("ids", [5, 2], {}, [5, 2]),
    ],
)
def test_regions_pick_the_nodes_they_describe(lattice, kind, value, options, expected):
    assert regions[kind](lattice, value, **options).tolist() == expected


def test_rows_do_not_depend_on_numbering(lattice):
    order = np.random.default_rng(0).permutation(lattice.node_count)
    place = np.argsort(order)
    shuffled = Lattice(lattice.positions[order], place[lattice.beams])
    assert set(order[regions["row"](shuffled, -1)]) == {10, 11, 12, 13}


@pytest.mark.parametrize(
    ("kind", "value", "options", "message"),
    [
        ("row", 4, {}, "row: expected -4 to 3, as the lattice has 4 rows, got 4"),
        ("row", -5, {}, "row: expected -4 to 3"),
        ("row", 0, {"leftmost": 4}, "leftmost: expected 1 to 3 nodes of row 0, got 4"),
        ("row", 0, {"rightmost": 0}, "rightmost: expected 1 to 3 nodes of row 0, got 0"),
        ("row", 0, {"leftmost": 1, "rightmost": 1}, "expected leftmost or rightmost, got both"),
        ("rows", [0, 9], {}, "row: expected -4 to 3"),
        ("box", [1, 0, 0, 1], {}, r"box: expected \[x_min, y_min, x_max, y_max\]"),
        ("box", [0, 1], {}, r"box: expected \[x_min, y_min, x_max, y_max\], got \[0, 1\]"),
        ("nearest", [1.0], {}, r"nearest: expected a point \[x, y\]"),
        ("nearest", [0.0, 0.0], {"count": 15}, "count: expected 1 to 14 nodes, got 15"),
        ("ids", [14], {}, r"ids\[0\]: expected a node from 0 to 13, got 14"),
        ("ids", [1, 1], {}, r"ids\[1\]: 1 is listed twice"),
    ],
)
def test_regions_that_cannot_be_are_refused(lattice, kind, value, options, message):
    with pytest.raises(InvalidProblem, match=message):
        regions[kind](lattice, value, **options)
