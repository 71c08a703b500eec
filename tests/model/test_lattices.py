from __future__ import annotations

import math
import tracemalloc
from unittest import mock

import numpy as np
import pytest
from scipy.spatial import cKDTree

from bellcrank.errors import InvalidProblem, UnknownName
from bellcrank.model import lattices
from bellcrank.model.regions import find_layers

EXAMPLES = {
    "triangular-rows": {"counts": [4, 5, 4], "first_x": [0.5, 0.0, 0.5]},
    "triangular-rectangle": {"columns": 6, "rows": 7},
    "displaced-delaunay": {"columns": 6, "rows": 7},
    "jammed-discs": {"discs": 60},
    "octet": {"size": [3, 4, 3]},
    "cubic": {"size": [3, 2, 2]},
    "body-centred": {"size": [3, 4, 3]},
    "kelvin": {"size": [6, 6, 6]},
    "displaced-delaunay-space": {"size": [3, 4, 3]},
    "nodes": {
        "positions": [[0.0, 0.0], [1.0, 0.0], [0.5, 0.8], [1.5, 0.8]],
        "beams": [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]],
    },
}
RANDOM = ("displaced-delaunay", "jammed-discs", "displaced-delaunay-space")
SPACE = ("octet", "cubic", "body-centred", "kelvin", "displaced-delaunay-space")
PLANE = tuple(kind for kind in EXAMPLES if kind not in SPACE)


def make(kind, seed=0, **changes):
    rng = {"rng": np.random.default_rng(seed)} if kind in RANDOM else {}
    return lattices[kind](**(EXAMPLES[kind] | changes), **rng)


def test_every_generator_is_tried_here():
    assert set(EXAMPLES) == set(lattices)


@pytest.mark.parametrize("kind", EXAMPLES)
def test_lattices_hang_together_and_have_no_dead_ends(kind):
    lattice = make(kind)
    assert lattice.reachable(np.array([0])).all()
    assert np.bincount(lattice.beams.ravel()).min() >= 2


@pytest.mark.parametrize("kind", EXAMPLES)
def test_beams_are_sorted_with_the_lower_node_first(kind):
    beams = make(kind).beams.tolist()
    assert beams == sorted(beams)
    assert all(a < b for a, b in beams)


@pytest.mark.parametrize("kind", PLANE)
def test_no_two_beams_cross(kind):
    lattice = make(kind)
    a, b = lattice.positions[lattice.beams].transpose(1, 0, 2)

    def side(p, q, r):
        return np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    for m in range(lattice.beam_count):
        for n in range(m):
            if not set(lattice.beams[m]) & set(lattice.beams[n]):
                across = side(a[m], b[m], a[n]) * side(a[m], b[m], b[n])
                along = side(a[n], b[n], a[m]) * side(a[n], b[n], b[m])
                assert across >= 0 or along >= 0


@pytest.mark.parametrize(
    ("kind", "changes"),
    [(kind, {}) for kind in SPACE]
    + [("cubic", {"diagonals": "faces"}), ("octet", {"up": [1, 1, 1], "envelope": "cylinder"})],
)
def test_no_two_beams_in_space_touch_between_their_ends(kind, changes):
    lattice = make(kind, **changes)
    first, second = lattice.positions[lattice.beams].transpose(1, 0, 2)
    share = np.linspace(0.1, 0.9, 9)[:, None]
    points = first[:, None] + share * (second - first)[:, None]
    spheres = cKDTree(points.reshape(-1, 3)).query_pairs(0.05, output_type="ndarray") // 9
    assert (spheres[:, 0] == spheres[:, 1]).all()


def test_octet_lattices_have_twelve_neighbours_and_layers_of_triangles():
    straight, turned = make("octet", size=[6, 6, 6]), make("octet", size=[6, 6, 6], up=[1, 1, 1])
    for lattice in (straight, turned):
        assert lattice.rest_length == pytest.approx(1.0)
        assert np.bincount(np.bincount(lattice.beams.ravel())).argmax() == 12
    layers = find_layers(turned)
    heights = np.array([turned.positions[nodes, 2].mean() for nodes in layers])
    assert np.diff(heights) == pytest.approx(math.sqrt(2.0 / 3.0))
    # A node on the axis, about which the lattice is the same after a third of a turn.
    tall = make("octet", size=[4, 4, 4], up=[1, 1, 1], envelope="cylinder")
    moved = tall.positions - np.array([2.0, 2.0, 0.0])
    c, s = -0.5, math.sqrt(0.75)
    third = moved @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    assert cKDTree(moved).query(third)[0].max() < 1e-9


@pytest.mark.parametrize(
    ("kind", "changes", "inner"),
    [
        ("cubic", {"diagonals": "none"}, 6),
        ("cubic", {"diagonals": "bodies"}, 14),
        ("cubic", {"diagonals": "faces"}, 18),
        ("body-centred", {}, 8),
        ("kelvin", {"size": [12, 12, 12]}, 4),
    ],
)
def test_inner_nodes_of_crystals_have_their_neighbours(kind, changes, inner):
    lattice = make(kind, **({"size": [6, 6, 6]} | changes))
    assert np.bincount(lattice.beams.ravel()).max() == inner


@pytest.mark.parametrize("kind", SPACE)
def test_a_crystal_is_in_the_middle_of_its_envelope(kind):
    changes = {"displacement": 0.0} if kind in RANDOM else {}
    lattice = make(kind, size=[5.3, 4.1, 6.2], **changes)
    low, high = lattice.positions.min(axis=0), lattice.positions.max(axis=0)
    assert 0.5 * (low + high) == pytest.approx([2.65, 2.05, 3.1])
    assert low.min() >= 0.0
    round_one = make(kind, size=[5.0, 5.0, 5.0], envelope="cylinder", **changes)
    assert np.hypot(*(round_one.positions[:, :2] - 2.5).T).max() <= 2.5 + 1e-6


def test_the_length_of_beams_is_the_spacing():
    for kind in ("octet", "body-centred", "kelvin"):
        lattice = make(kind, size=[12, 12, 12], spacing=2.0)
        assert lattice.rest_length == pytest.approx(2.0)


@pytest.mark.parametrize("kind", RANDOM)
def test_a_seed_names_one_lattice(kind):
    assert (make(kind, seed=3).positions == make(kind, seed=3).positions).all()
    assert make(kind, seed=3).positions[0, 0] != make(kind, seed=4).positions[0, 0]


def test_triangular_beams_all_have_the_length_of_the_spacing():
    lattice = make("triangular-rectangle", spacing=2.5)
    assert lattice.rest_length == pytest.approx(2.5, abs=1e-12)


def test_interior_nodes_of_a_triangular_lattice_have_six_neighbours():
    lattice = make("triangular-rectangle")
    x, y = lattice.positions.T
    inside = (x > 0.6) & (x < 5.4) & (y > 0.1) & (y < 5.1)
    assert set(np.bincount(lattice.beams.ravel())[inside]) == {6}


def test_delaunay_without_displacement_is_the_triangular_rectangle():
    regular = make("triangular-rectangle")
    assert make("displaced-delaunay", displacement=0.0).beams.tolist() == regular.beams.tolist()


def test_delaunay_leaves_no_slivers_at_the_hull():
    for seed in range(10):
        lattice = make("displaced-delaunay", seed=seed, displacement=0.3)
        assert lattice.rest_length.max() < 2.1


def test_discs_are_jammed_so_that_the_inner_network_is_stiff():
    # Maxwell: without friction, at least 4 contacts per disc in the mean.
    lattice = make("jammed-discs", discs=200)
    low, high = lattice.positions.min(axis=0) + 2.0, lattice.positions.max(axis=0) - 2.0
    inside = ((lattice.positions > low) & (lattice.positions < high)).all(axis=1)
    assert np.bincount(lattice.beams.ravel())[inside].mean() > 4.0


def test_contacts_have_only_the_three_lengths_that_two_sizes_allow():
    length = make("jammed-discs", discs=200, packing_fraction=0.85).rest_length
    relative = length / length.max()
    allowed = np.array([2.0, 2.4, 2.8]) / 2.8
    assert np.abs(relative[:, None] - allowed).min(axis=1).max() < 0.05


@pytest.mark.parametrize(
    ("kind", "changes", "message"),
    [
        (
            "triangular-rows",
            {"counts": [3, 0, 3]},
            r"lattice.counts\[1\]: expected at least 1",
        ),
        ("triangular-rows", {"counts": [3]}, "expected as many counts as first_x"),
        ("triangular-rows", {"counts": [], "first_x": []}, "at least one of each"),
        ("triangular-rows", {"spacing": 0.0}, "lattice.spacing: expected a number greater than 0"),
        (
            "triangular-rows",
            {"first_x": [0.0, 0.25, 0.5]},
            r"lattice.first_x\[1\]: .* shifted by half a spacing .* got a shift of 0.25",
        ),
        ("triangular-rectangle", {"rows": 1}, "at least 1 column and 2 rows"),
        ("displaced-delaunay", {"displacement": 0.5}, "lattice.displacement: expected 0 or more"),
        ("jammed-discs", {"discs": 19}, "lattice.discs: expected at least 20, got 19"),
        ("jammed-discs", {"packing_fraction": 0.5}, "lattice.packing_fraction: expected 0.85"),
        ("octet", {"size": [3, 3]}, r"lattice.size: expected three lengths .* got \[3, 3\]"),
        ("octet", {"size": [3, 3, -1]}, "lattice.size: expected three lengths"),
        ("octet", {"size": [0.1, 0.1, 0.1]}, "lattice.size: no beam of the lattice fits"),
        ("octet", {"up": [0, 0, 0]}, "lattice.up: expected three integers"),
        ("octet", {"envelope": "ball"}, "lattice.envelope: expected 'box' or 'cylinder'"),
        ("octet", {"spacing": 0.0}, "lattice.spacing: expected a number greater than 0"),
        ("cubic", {"diagonals": "all"}, "lattice.diagonals: expected 'none', 'faces', 'bodies'"),
        ("displaced-delaunay-space", {"size": [1, 1, 1]}, "lattice.size: expected room"),
        ("displaced-delaunay-space", {"displacement": 0.5}, "lattice.displacement: expected 0"),
    ],
)
def test_impossible_parameters_are_refused(kind, changes, message):
    with pytest.raises(InvalidProblem, match=message):
        make(kind, **changes)


def test_unknown_lattices_list_the_known_ones():
    with pytest.raises(UnknownName, match=r"unknown lattice 'square'; known: .*triangular-rows"):
        lattices["square"]


@pytest.mark.parametrize(
    ("kind", "size", "key"),
    [
        ("triangular-rectangle", {"columns": 10_000, "rows": 10_000}, "lattice.columns"),
        ("triangular-rectangle", {"columns": 2, "rows": 10**12}, "lattice.columns"),
        ("triangular-rows", {"counts": [10**9, 10**9], "first_x": [0.0, 0.5]}, "lattice.counts"),
        ("displaced-delaunay", {"columns": 10_000, "rows": 10_000}, "lattice.columns"),
        ("jammed-discs", {"discs": 10**8}, "lattice.discs"),
        ("octet", {"size": [1000, 1000, 1000]}, "lattice.size"),
        ("octet", {"size": [3000, 1, 3000], "up": [1, 1, 1]}, "lattice.size"),
        ("displaced-delaunay-space", {"size": [1e4, 1e4, 1e4]}, "lattice.size"),
    ],
)
def test_a_lattice_that_does_not_fit_is_refused_before_it_is_generated(kind, size, key):
    with (
        mock.patch.object(np, "arange", side_effect=MemoryError),
        pytest.raises(
            InvalidProblem,
            match=rf"{key}: .* too large; expected at most 250,000 nodes .*500 x 500",
        ),
    ):
        make(kind, **size)


def test_wide_rows_need_memory_in_proportion_to_their_nodes():
    tracemalloc.start()
    lattice = make("triangular-rows", counts=[10_000, 10_000], first_x=[0.0, 0.5])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert lattice.beam_count == 2 * 9_999 + 19_999
    assert peak < 100e6  # 800 MB, were all nodes compared with all others
