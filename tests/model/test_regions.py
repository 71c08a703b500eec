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


@pytest.fixture
def cube() -> Lattice:
    """27 nodes numbered along x, then y, then z."""
    return lattices["cubic"](size=[2, 2, 2], diagonals="none")


@pytest.mark.parametrize(
    ("kind", "value", "options", "expected"),
    [
        ("layer", 0, {}, list(range(9))),
        ("layer", -1, {"axis": "x"}, [2, 5, 8, 11, 14, 17, 20, 23, 26]),
        ("layer", 1, {"radius": [0.0, 0.5]}, [13]),
        ("layer", 2, {"radius": [1.0, 1.2]}, [19, 21, 23, 25]),
        ("layer", 0, {"radius": [0, 0], "around": [2, 0]}, [2]),
        ("sphere", [1, 1, 1], {"radius": 1.0}, [4, 10, 12, 13, 14, 16, 22]),
        ("box", [0, 0, 0, 0, 2, 0], {}, [0, 3, 6]),
        ("nearest", [2, 2, 2], {"count": 2}, [17, 26]),
    ],
)
def test_regions_in_space_pick_the_nodes_they_describe(cube, kind, value, options, expected):
    assert regions[kind](cube, value, **options).tolist() == expected


@pytest.mark.parametrize(
    ("kind", "value", "options", "message"),
    [
        ("row", 0, {}, "in space use layer, box, sphere or nearest"),
        ("layer", 3, {}, "layer: expected -3 to 2, as the lattice has 3 layers along z, got 3"),
        ("layer", 0, {"axis": "w"}, "axis: expected 'x', 'y' or 'z', got 'w'"),
        ("layer", 0, {"radius": [2, 1]}, r"radius: expected \[smallest, largest\], got \[2, 1\]"),
        ("layer", 0, {"radius": [5, 6]}, "radius: no node of layer 0 lies between 5 and 6"),
        ("layer", 0, {"around": [0, 0]}, "around: expected with radius"),
        ("layer", 0, {"around": [0], "radius": [0, 1]}, "around: expected two coordinates"),
        ("sphere", [0, 0], {"radius": 1}, r"sphere: expected a point \[x, y, z\], got \[0, 0\]"),
        ("sphere", [0, 0, 0], {"radius": -1.0}, "radius: expected 0 or more, got -1"),
        ("sphere", [0.5, 0.5, 0.5], {"radius": 0.1}, "sphere: no node lies within 0.1"),
    ],
)
def test_regions_in_space_that_cannot_be_are_refused(cube, kind, value, options, message):
    with pytest.raises(InvalidProblem, match=message):
        regions[kind](cube, value, **options)


def test_layers_are_refused_in_the_plane(lattice):
    with pytest.raises(InvalidProblem, match="layer: expected a lattice in space; in the plane"):
        regions["layer"](lattice, 0)
