"""Symmetric designs, in the plane and in space."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem
from bellcrank.model import Input, Output, Problem, Section, Specification, Supports, lattices
from bellcrank.search.symmetry import SymmetryGroups, beam_images, node_images, operation


def column(kind: str, **options: object) -> Problem:
    """Return a lattice in space, whose lowest nodes are held, all beams designable."""
    lattice = lattices[kind](**options)
    height = lattice.positions[:, 2]
    order = np.argsort(height, kind="stable")
    held = np.flatnonzero(height < height.min() + 1e-6)
    top = order[-2:]
    return Problem(
        name=kind, lattice=lattice, supports=Supports(fixed=held), section=Section.round(0.2),
        input=Input([top[1]], [0, 0, -1], "displacement", 0.1), output=Output([top[0]], [0, 0, 1]),
        designable=np.arange(lattice.beam_count),
    )  # fmt: skip


OCTETS = {"size": [4, 4, 3], "up": [1, 1, 1], "envelope": "cylinder"}


@pytest.mark.parametrize(
    ("kind", "options", "names"),
    [
        ("octet", OCTETS, ["3-fold", "x"]),
        ("cubic", {"size": [2, 2, 3]}, ["4-fold", "2-fold", "x", "y"]),
        ("body-centred", {"size": [3, 3, 2]}, ["4-fold", "z"]),
    ],
)
def test_images_are_beams_that_the_symmetry_moves_onto_each_other(
    kind: str, options: dict[str, object], names: list[str]
) -> None:
    problem = column(kind, **options)
    lattice = problem.lattice
    for name in names:
        matrix, centre = operation(problem, name)
        assert matrix @ matrix.T == pytest.approx(np.eye(3))
        nodes = node_images(problem, name)
        moved = (lattice.positions - centre) @ matrix.T + centre
        assert lattice.positions[nodes] == pytest.approx(moved, abs=1e-6)
        beams = beam_images(problem, name)
        assert sorted(beams.tolist()) == list(range(lattice.beam_count))
        middle = lattice.positions[lattice.beams].mean(axis=1)
        assert middle[beams] == pytest.approx((middle - centre) @ matrix.T + centre, abs=1e-6)


def test_groups_have_as_many_beams_as_the_symmetry_has_operations() -> None:
    problem = column("octet", **OCTETS)
    groups = SymmetryGroups(problem, ["3-fold"])
    _, sizes = np.unique(groups.group, return_counts=True)
    assert set(sizes.tolist()) <= {1, 3}
    assert (sizes == 3).sum() > 20
    both = SymmetryGroups(problem, ["3-fold", "x"])
    assert len(both.beams) < len(groups.beams)
    assert np.unique(both.group, return_counts=True)[1].max() <= 6
    mask = np.zeros(problem.lattice.beam_count, dtype=bool)
    mask[groups.beams[:4]] = True
    whole = groups.with_images(mask)
    assert whole.sum() == sizes[:4].sum()
    assert np.array_equal(groups.expand(whole), whole)


def test_a_symmetry_that_the_lattice_does_not_have_is_refused() -> None:
    with pytest.raises(ValueError, match=r"not symmetric in 4-fold: .* have no designable image"):
        SymmetryGroups(column("octet", **OCTETS), ["4-fold"])
    with pytest.raises(InvalidProblem, match="symmetry: expected one of x, y, z, 2-fold"):
        Specification(symmetry=("5-fold",))


def test_a_rotation_turns_counter_clockwise_about_the_vertical_axis() -> None:
    matrix, _ = operation(column("octet", **OCTETS), "3-fold")
    angle = 2.0 * math.pi / 3.0
    turned = [math.cos(angle), math.sin(angle), 0.0]
    assert matrix @ np.array([1.0, 0.0, 0.0]) == pytest.approx(turned)
    assert matrix @ np.array([0.0, 0.0, 1.0]) == pytest.approx([0.0, 0.0, 1.0])
