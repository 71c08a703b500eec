"""Views lose nothing: each beam can be read back."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import InvalidDataset
from bellcrank.model import Problem, find_problem
from bellcrank.surrogate.views import GridView, views

from .helpers import random_masks

TRIANGULAR = ["crane", "anti-parallel", "pliers", "scaling-8", "scaling-20"]


@pytest.mark.parametrize("name", [*TRIANGULAR, "discs"])
def test_each_beam_has_a_cell_of_its_own_in_the_grid(name: str) -> None:
    problem = find_problem(name)
    view = GridView(problem)
    assert len(np.unique(view.place)) == problem.lattice.beam_count
    each = np.packbits(np.eye(problem.lattice.beam_count, dtype=bool), axis=1)
    cells = view.look(each).reshape(len(each), -1)
    assert (cells.sum(axis=1) == 1).all()
    assert np.array_equal(cells.argmax(axis=1), view.place)


@pytest.mark.parametrize("name", TRIANGULAR)
def test_a_triangular_lattice_needs_a_channel_for_each_direction_and_hardly_more_cells_than_nodes(
    name: str,
) -> None:
    lattice = find_problem(name).lattice
    channels, rows, columns = GridView(find_problem(name)).shape
    assert channels == 3
    along = np.diff(lattice.positions[lattice.beams], axis=1)[:, 0]
    directions = np.round(np.arctan2(along[:, 1], along[:, 0]) * 3 / np.pi) % 3
    place = GridView(find_problem(name)).place // (rows * columns)
    assert len({*zip(directions, place, strict=True)}) == 3
    assert rows * columns < 3 * lattice.node_count


@pytest.mark.parametrize("name", TRIANGULAR)
def test_beams_to_the_right_and_up_from_a_node_are_in_one_cell(name: str) -> None:
    lattice = find_problem(name).lattice
    view = GridView(find_problem(name))
    cell = view.place % (view.shape[1] * view.shape[2])
    ends = lattice.positions[lattice.beams]
    first = np.lexsort(ends.transpose(2, 0, 1), axis=1)[:, 0]  # the lower end, or the left one
    start = lattice.beams[np.arange(len(ends)), first]
    along = np.diff(np.take_along_axis(ends, first[:, None, None] ^ [[[0], [1]]], 1), axis=1)[:, 0]
    ahead = along[:, 0] > 0.0
    for node in range(lattice.node_count):
        assert len(set(cell[ahead & (start == node)].tolist())) <= 1
    of_node = dict(zip(start[ahead].tolist(), cell[ahead].tolist(), strict=True))
    assert len(set(of_node.values())) == len(of_node)


def test_a_disordered_lattice_needs_more_channels() -> None:
    assert GridView(find_problem("discs")).shape[0] > 3


@pytest.mark.parametrize("name", list(views))
def test_every_view_turns_masks_into_bytes_of_its_shape(name: str, problem: Problem) -> None:
    view = views[name](problem)
    masks = random_masks(problem, 5)
    seen = view.look(np.packbits(masks, axis=1))
    assert seen.shape == (5, *view.shape)
    assert seen.dtype == np.uint8
    assert 0.99 < seen.max() * view.scale <= 1.0
    again = views[name](problem, **view.to_dict())
    assert np.array_equal(again.look(np.packbits(masks, axis=1)), seen)
    with pytest.raises(InvalidDataset, match="packed: expected masks of 28 bytes"):
        view.look(np.zeros((2, 5), np.uint8))


def test_bits_are_the_mask(problem: Problem) -> None:
    masks = random_masks(problem, 5)
    assert np.array_equal(views["bits"](problem).look(np.packbits(masks, axis=1)), masks)
