from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem
from bellcrank.model import Lattice

SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]


def test_rest_lengths_are_distances_at_rest():
    lattice = Lattice([[0, 0], [3, 4], [3, 0]], [[0, 1], [1, 2]])
    assert lattice.rest_length.tolist() == [5.0, 4.0]


def test_arrays_are_copied_and_cannot_be_written_to():
    positions = np.array(SQUARE)
    lattice = Lattice(positions, [[0, 1]])
    positions[0, 0] = 9.0
    assert lattice.positions[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        lattice.positions[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        lattice.beams[0, 0] = 1


@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_copies_stay_read_only(again):
    lattice = again(Lattice(SQUARE, [[0, 1]]))
    assert not lattice.positions.flags.writeable
    assert lattice.beams.tolist() == [[0, 1]]


def test_order_and_orientation_of_beams_are_kept():
    assert Lattice(SQUARE, [[3, 2], [0, 1]]).beams.tolist() == [[3, 2], [0, 1]]


def test_a_lattice_may_lie_in_space():
    assert Lattice([[0, 0, 0], [0, 0, 2]], [[0, 1]]).rest_length.tolist() == [2.0]


@pytest.mark.parametrize(
    ("positions", "beams", "message"),
    [
        ([[0, 0, 0, 0], [1, 0, 0, 0]], [[0, 1]], r"positions: expected shape \(N, 2\).*\(2, 4\)"),
        ([], [[0, 1]], r"positions: expected shape \(N, 2\)"),
        ([[0, 0], [1]], [[0, 1]], r"positions\[1\]: expected 2 numbers as in positions\[0\], got"),
        ([["0", "0"], ["1", "0"]], [[0, 1]], "positions: expected numbers, got values of type <U1"),
        (
            [[0, 0], [1, np.nan]],
            [[0, 1]],
            r"positions\[1\]\[1\]: expected a finite number, got nan",
        ),
        ([[0, 0], [np.inf, 1]], [[0, 1]], r"positions\[1\]\[0\]: expected a finite .* got inf"),
        (SQUARE, [], r"beams: expected shape \(M, 2\)"),
        (SQUARE, [[0, 1, 2]], r"beams: expected shape \(M, 2\) with M >= 1, got shape \(1, 3\)"),
        (SQUARE, [[0.0, 1.5]], "beams: expected integers, got values of type float64"),
        (SQUARE, [[0, 1], [1, 4]], r"beams\[1\]\[1\]: expected a node from 0 to 3, got 4"),
        (SQUARE, [[0, 1], [-1, 2]], r"beams\[1\]\[0\]: expected a node from 0 to 3, got -1"),
        (SQUARE, [[0, 1], [2, 2]], r"beams\[1\]: joins node 2 to itself"),
        (SQUARE, [[0, 1], [1, 2], [0, 1]], r"beams\[2\]: \[0, 1\] is the same beam as beams\[0\]"),
        (SQUARE, [[0, 1], [1, 2], [2, 1]], r"beams\[2\]: \[2, 1\] is the same beam as beams\[1\]"),
        ([[0, 0], [0, 0], [1, 1]], [[0, 2], [0, 1]], r"beams\[1\]: has no length, nodes 0 and 1"),
    ],
)
def test_impossible_lattices_are_refused_naming_the_first_offender(positions, beams, message):
    with pytest.raises(InvalidProblem, match=message):
        Lattice(positions, beams)


def test_only_joined_nodes_are_reachable():
    lattice = Lattice(SQUARE, [[0, 1], [3, 2]])
    assert lattice.reachable(np.array([2])).tolist() == [False, False, True, True]
