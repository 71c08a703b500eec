from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import InvalidFile, InvalidProblem, OutputExists, UnknownName
from bellcrank.model import Lattice, find_problem, formats, network_of, read_network, write_network
from bellcrank.model.formats import Network, NodeRole

PAIR = """title, whatever it says
2 atoms
1 bonds

Atoms # bond

2 1 3 1.5 0.0 0.0
1 1 1 0.0 0.0 0.0

Bonds

1 1 1 2
"""


def networks():
    space = Lattice([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]], [[2, 0], [0, 1]])
    return {
        "crane": network_of(find_problem("crane").full_design()),
        "discs": network_of(find_problem("discs").full_design()),
        "space": Network(space, [1, 2, 7]),
    }


@pytest.mark.parametrize("name", networks())
@pytest.mark.parametrize("kind", formats)
def test_every_format_reads_back_exactly_what_it_wrote(tmp_path, kind, name):
    network = networks()[name]
    for suffix in formats[kind].suffixes:
        path = tmp_path / f"network{suffix}"
        write_network(network, path)
        again = read_network(path)
        assert again.lattice.positions.tolist() == network.lattice.positions.tolist()
        assert again.lattice.beams.tolist() == network.lattice.beams.tolist()
        assert again.roles.tolist() == network.roles.tolist()
        with pytest.raises(OutputExists):
            write_network(network, path)


def test_only_the_beams_of_a_design_are_written_but_all_nodes():
    design = find_problem("crane").full_design()
    mask = design.mask.copy()
    mask[design.problem.designable] = False
    network = network_of(design.with_mask(mask))
    assert network.lattice.beam_count == 149
    assert network.lattice.node_count == 133


def test_nodes_carry_their_roles():
    problem = find_problem("pliers")
    roles = network_of(problem.full_design()).roles
    assert set(np.flatnonzero(roles == NodeRole.SUPPORT)) == set(problem.supports.nodes)
    assert set(np.flatnonzero(roles == NodeRole.INPUT)) == set(problem.input.nodes)
    assert set(np.flatnonzero(roles == NodeRole.OUTPUT)) == set(problem.output.nodes)


def test_all_atoms_of_a_lammps_file_lie_inside_its_box(tmp_path):
    network = networks()["space"]
    write_network(network, tmp_path / "a.lammps")
    words = [line.split() for line in (tmp_path / "a.lammps").read_text().splitlines()]
    bounds = np.array(
        [[float(w[0]), float(w[1])] for w in words if w[-1:] and w[-1].endswith("hi")]
    )
    assert bounds.shape == (3, 2)
    assert (network.lattice.positions > bounds[:, 0]).all()
    assert (network.lattice.positions < bounds[:, 1]).all()


def test_atoms_and_bonds_of_a_lammps_file_are_sorted_by_their_ids(tmp_path):
    (tmp_path / "a.data").write_text(PAIR)
    network = read_network(tmp_path / "a.data")
    assert network.lattice.positions.tolist() == [[0.0, 0.0], [1.5, 0.0]]
    assert network.lattice.beams.tolist() == [[0, 1]]
    assert network.roles.tolist() == [1, 3]


@pytest.mark.parametrize(
    ("heading", "first", "second"),
    [
        ("Atoms # atomic", "1 1 0 0 0", "2 3 1.5 0 0"),
        ("Atoms", "1 1 0 0 0", "2 3 1.5 0 0"),
        ("Atoms", "1 1 1 0 0 0", "2 1 3 1.5 0 0"),
        ("Atoms # molecular", "1 1 1 0 0 0 0 0 -1", "2 1 3 1.5 0 0 0 0 0"),
        ("Atoms # full", "1 1 1 -0.5 0 0 0", "2 1 3 0.5 1.5 0 0"),
    ],
)
def test_lammps_files_of_other_styles_are_read(tmp_path, heading, first, second):
    text = PAIR.replace("Atoms # bond", heading)
    text = text.replace("2 1 3 1.5 0.0 0.0", second).replace("1 1 1 0.0 0.0 0.0", first)
    (tmp_path / "a.data").write_text(text)
    network = read_network(tmp_path / "a.data")
    assert network.lattice.positions.tolist() == [[0.0, 0.0], [1.5, 0.0]]
    assert network.roles.tolist() == [1, 3]


@pytest.mark.parametrize(
    ("old", "new", "error", "message"),
    [
        ("Bonds", "Angles", InvalidFile, "a LAMMPS data file with a section 'Bonds'"),
        ("# bond", "# sphere", InvalidFile, "Atoms: expected a style among atomic"),
        (
            "1.5 0.0 0.0",
            "1.5 0.0 up",
            InvalidFile,
            "line 7: expected numbers, got '2 1",
        ),
        ("1.5 0.0 0.0", "nan 0.0 0.0", InvalidFile, "line 7: expected numbers"),
        ("1 1 1 0.0 0.0 0.0", "1 1 1 0.0", InvalidFile, "line 8: expected 6 numbers, got 4"),
        ("1 1 1 2", "1 1 1 9", InvalidFile, "Bonds: bond 1 names atom 9, which does not exist"),
        ("1 1 1 2", "1 1 1 2 3", InvalidFile, "Bonds: expected 4 columns, got 5"),
        ("1 1 1 2", "", InvalidFile, "expected at least one atom and one bond"),
        ("1 1 1 0.0", "2 1 1 0.0", InvalidFile, "Atoms: atom 2 is listed twice"),
        ("1.5 0.0", "0.0 0.0", InvalidProblem, r"beams\[0\]: has no length"),
        ("2 1 3", "2 1 0", InvalidProblem, "roles: expected one number from 1 up"),
    ],
)
def test_bad_lammps_files_are_refused_naming_file_and_line(tmp_path, old, new, error, message):
    assert old in PAIR
    (tmp_path / "a.data").write_text(PAIR.replace(old, new))
    with pytest.raises(error, match=message) as caught:
        read_network(tmp_path / "a.data")
    assert "a.data" in str(caught.value)


def test_unknown_suffixes_list_the_known_ones(tmp_path):
    with pytest.raises(UnknownName, match=r"lattice format '.xyz'; known suffixes: .lammps"):
        read_network(tmp_path / "a.xyz")
