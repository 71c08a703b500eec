from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.image import imread

from bellcrank.errors import InvalidProblem, InvalidSettings, OutputExists, StorageError
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import Design, Lattice, Output, builtin, find_problem, human_design
from bellcrank.plots import (
    ChainPath,
    Motion,
    PathOptions,
    draw_comparison,
    draw_design,
    draw_motion,
    draw_paths,
)
from bellcrank.plots.scene import beam_kinds, displacement_arrows, input_arrows, output_arrows


@pytest.fixture(scope="module")
def motion():
    design = human_design("crane")
    response = SpringEvaluator(design.problem).evaluate(design.mask)
    return Motion(design, response.displacement, response.efficiency, name="human")


@pytest.fixture(scope="module")
def draw(motion):
    """Drawing functions by name."""
    chains = [ChainPath(np.linspace(0.0, top, 40)) for top in (1.0, 2.0)]
    return {
        "motion": lambda path, **more: draw_motion(motion, path, **more),
        "comparison": lambda path, **more: draw_comparison(motion, motion, path, **more),
        "design": lambda path, **more: draw_design(motion.design, path, **more),
        "paths": lambda path, **more: draw_paths(chains, path, **more),
    }


SIMILAR = {f"scaling-{n}" for n in range(9, 20)} | {"anti-parallel"}
NAMES = ["motion", "comparison", "design", "paths"]


@pytest.fixture(scope="module")
def drawn(draw, tmp_path_factory):
    """A folder with one file of each picture."""
    folder = tmp_path_factory.mktemp("drawn")
    for name in NAMES:
        draw[name](folder / f"{name}.png")
    return folder


@pytest.mark.parametrize("name", ["motion", "paths"])
@pytest.mark.parametrize(
    ("suffix", "start"), [("svg", b"<?xml"), ("pdf", b"%PDF"), ("PNG", b"\x89PNG")]
)
def test_the_suffix_chooses_the_format(draw, tmp_path, name, suffix, start):
    path = tmp_path / f"picture.{suffix}"
    draw[name](path)
    content = path.read_bytes()
    assert content.startswith(start)
    assert len(content) > 5000
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("name", NAMES)
def test_no_ink_is_cut_off_at_the_edge(drawn, name):
    picture = imread(drawn / f"{name}.png")[..., :3]
    edge = np.concatenate([picture[:8].reshape(-1, 3), picture[-8:].reshape(-1, 3)])
    sides = np.concatenate([picture[:, :8].reshape(-1, 3), picture[:, -8:].reshape(-1, 3)])
    assert picture.min() < 0.2
    assert edge.min() == 1.0
    assert sides.min() == 1.0


def test_pictures_have_seven_or_eleven_inches_at_200_dots(drawn):
    widths = {name: imread(drawn / f"{name}.png").shape[1] for name in NAMES}
    assert widths == {"motion": 1400, "comparison": 2200, "design": 1400, "paths": 1400}


@pytest.mark.parametrize("suffix", ["png", "pdf"])
def test_the_same_picture_is_the_same_file(draw, tmp_path, suffix):
    for k in range(2):
        draw["paths"](tmp_path / f"{k}.{suffix}")
    assert (tmp_path / f"0.{suffix}").read_bytes() == (tmp_path / f"1.{suffix}").read_bytes()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("file", ["picture.jpg", "picture", "picture.png.txt"])
def test_an_unknown_suffix_is_rejected(draw, tmp_path, name, file):
    with pytest.raises(InvalidSettings, match=r"ending in \.png, \.svg, \.pdf"):
        draw[name](tmp_path / file)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", NAMES)
def test_an_existing_file_is_kept_by_default(draw, tmp_path, name):
    path = tmp_path / "picture.png"
    path.write_text("precious")
    with pytest.raises(OutputExists, match="exists"):
        draw[name](path)
    assert path.read_text() == "precious"


def test_an_existing_file_is_replaced_on_demand(draw, tmp_path):
    path = tmp_path / "picture.png"
    path.write_text("old")
    draw["paths"](path, overwrite=True)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_a_missing_folder_is_a_storage_error(draw, tmp_path):
    with pytest.raises(StorageError, match=r"cannot be written \(No such file or directory\)"):
        draw["paths"](tmp_path / "missing" / "picture.png")


def test_a_full_disk_keeps_the_old_picture_and_leaves_no_debris(draw, tmp_path, monkeypatch):
    def fail(descriptor):
        raise OSError(28, "No space left on device")

    path = tmp_path / "picture.png"
    path.write_text("old")
    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(StorageError, match="No space left"):
        draw["paths"](path, overwrite=True)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("picture.png", "old")]


def test_of_two_writers_the_first_wins(draw, tmp_path, monkeypatch):
    path = tmp_path / "picture.png"

    def somebody_was_faster(source, target):
        path.write_text("first")
        raise FileExistsError

    monkeypatch.setattr("os.link", somebody_was_faster)
    with pytest.raises(OutputExists):
        draw["paths"](path)
    assert path.read_text() == "first"


def test_drawing_changes_nothing_global(draw, tmp_path):
    before = dict(mpl.rcParams)
    for name in NAMES:
        draw[name](tmp_path / f"{name}.png")
    assert dict(mpl.rcParams) == before


def test_pyplot_is_never_imported():
    code = "import sys, bellcrank.plots; print('matplotlib.pyplot' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_the_package_does_not_import_the_pictures():
    code = "import sys, bellcrank; print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_loose_pieces_and_dead_ends_are_unloaded(motion, tmp_path):
    problem = motion.design.problem
    mask = motion.design.mask.copy()
    absent = problem.designable[~mask[problem.designable]]
    touching = problem.lattice.beams_touching(np.unique(problem.lattice.beams[mask]))
    loose, ends = absent[~touching[absent]], absent[touching[absent]]
    mask[loose[:1]] = True
    kinds = beam_kinds(motion.design.with_mask(mask))
    assert loose[0] in kinds.unloaded
    assert len(ends)
    everything = np.concatenate([kinds.ground, kinds.unloaded, kinds.load_bearing])
    assert np.array_equal(np.sort(everything), np.flatnonzero(mask))
    draw_motion(replace(motion, design=motion.design.with_mask(mask)), tmp_path / "loose.png")


@pytest.mark.parametrize("name", [name for name in builtin if name not in SIMILAR])
def test_every_kind_of_problem_can_be_drawn(name, tmp_path):
    design = find_problem(name).full_design()
    still = np.zeros_like(design.problem.lattice.positions)
    draw_motion(Motion(design, still), tmp_path / "motion.png")


def test_a_design_without_a_response_is_drawn_at_rest(motion, tmp_path):
    nothing = np.full(motion.displacement.shape, np.nan)
    lost = Motion(motion.design, nothing, float("nan"), note="mechanism")
    assert lost.caption == "no efficiency · 198 beams · mechanism"
    assert np.array_equal(lost.moved, motion.design.problem.lattice.positions)
    draw_motion(lost, tmp_path / "lost.png", title="costs $5, or $6")


def test_lower_edges_of_shifted_lattices_are_aligned(motion, tmp_path):
    problem = motion.design.problem
    lattice = Lattice(problem.lattice.positions + np.array([3.0, -40.0]), problem.lattice.beams)
    shifted = replace(motion, design=Design(replace(problem, lattice=lattice), motion.design.mask))
    draw_comparison(motion, motion, tmp_path / "a.png")
    draw_comparison(motion, shifted, tmp_path / "b.png")
    assert imread(tmp_path / "a.png").shape == imread(tmp_path / "b.png").shape


def test_an_empty_design_can_be_drawn(motion, tmp_path):
    nothing = motion.design.with_mask(np.zeros_like(motion.design.mask))
    draw_motion(Motion(nothing, np.zeros_like(motion.displacement)), tmp_path / "none.png")


def test_magnified_motion_is_noted(motion):
    large = replace(motion, magnify=2.5)
    rest = motion.design.problem.lattice.positions
    assert np.allclose(large.moved - rest, 2.5 * (motion.moved - rest))
    assert large.caption.endswith("motion drawn 2.5 times its size")


@pytest.mark.parametrize("magnify", [0.0, -1.0, float("nan"), float("inf")])
def test_magnification_must_be_positive_and_finite(motion, magnify):
    with pytest.raises(InvalidSettings, match="magnify"):
        replace(motion, magnify=magnify)


def test_a_displacement_of_the_wrong_shape_is_rejected(motion):
    with pytest.raises(InvalidProblem, match=r"expected shape \(133, 2\).*got \(7, 2\)"):
        Motion(motion.design, np.zeros((7, 2)))


def test_arrows_point_in_the_direction_of_their_region(motion):
    problem = motion.design.problem
    (push,) = input_arrows(problem)
    (wanted,) = output_arrows(problem, motion.moved)
    assert push.tip[0] == pytest.approx(push.tail[0])
    assert push.tip[1] < push.tail[1]
    assert push.tip[1] > problem.lattice.positions[problem.input.nodes, 1].max()
    assert wanted.tip[0] < wanted.tail[0] < motion.moved[problem.output.nodes, 0].min()
    assert len(displacement_arrows(motion)) == len(problem.output.nodes)


def test_nodes_with_different_directions_have_their_own_arrows(motion, tmp_path):
    problem = motion.design.problem
    nodes = problem.output.nodes
    angle = np.linspace(0.0, 3.0, len(nodes))
    around = Output(nodes=nodes, direction=np.stack([np.cos(angle), np.sin(angle)], axis=1))
    turned = replace(motion.design, problem=replace(problem, output=around))
    assert len(output_arrows(turned.problem, motion.moved)) == len(nodes)
    draw_design(turned, tmp_path / "turned.png")


def test_chains_without_any_efficiency_can_be_drawn(tmp_path):
    chains = [ChainPath(np.full(5, np.nan)), ChainPath(np.empty(0))]
    draw_paths(chains, tmp_path / "nothing.png", PathOptions(annealing_steps=100))


def test_values_that_are_not_finite_do_not_hide_the_peak_of_a_path():
    path = ChainPath(np.array([0.1, np.nan, 0.7, np.inf, 0.2]))
    assert path.peak == 2


@pytest.mark.parametrize("chains", [1, 64])
@pytest.mark.parametrize("axis", ["accepted", "proposals"])
def test_few_and_many_chains_can_be_drawn(tmp_path, chains, axis):
    rng = np.random.default_rng(1)
    paths = [
        ChainPath(np.cumsum(rng.normal(0.01, 0.02, 3000)), np.cumsum(rng.integers(1, 9, 3000)))
        for _ in range(chains)
    ]
    shown = PathOptions(
        title="crane", annealing_steps=100, human_efficiency=1.0, final_efficiency=2.0,
        best=(chains - 1, 17), axis=axis,
    )  # fmt: skip
    draw_paths(paths, tmp_path / "paths.png", shown)


@pytest.mark.parametrize(
    ("chains", "shown", "message"),
    [
        ([], PathOptions(), "at least one"),
        (
            [ChainPath(np.zeros(3))],
            PathOptions(best=(0, 3)),
            "best: no design with index 3 in chain 0",
        ),
        ([ChainPath(np.zeros(3))], PathOptions(axis="time"), "accepted, proposals, got 'time'"),
        ([ChainPath(np.zeros(3))], PathOptions(axis="proposals"), "step: required"),
    ],
)
def test_invalid_paths_are_rejected(tmp_path, chains, shown, message):
    with pytest.raises(InvalidSettings, match=message):
        draw_paths(chains, tmp_path / "paths.png", shown)
    assert list(tmp_path.iterdir()) == []


def test_steps_must_match_efficiencies():
    with pytest.raises(InvalidSettings, match=r"step: expected shape \(3,\)"):
        ChainPath(np.zeros(3), np.arange(4))
    with pytest.raises(InvalidSettings, match="efficiency: expected shape"):
        ChainPath(np.zeros((3, 2)))
