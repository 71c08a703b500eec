from __future__ import annotations

import io
import subprocess
import sys
from dataclasses import replace

import av
import numpy as np
import pytest
from PIL import Image

from bellcrank.errors import InvalidProblem, InvalidSettings, OutputExists, StorageError
from bellcrank.mechanics import FrameEvaluator, SpringEvaluator, strain_of
from bellcrank.model import Design, Input, Lattice, Output, Problem, Stiffness, Supports
from bellcrank.plots.movies import (
    MovieFigure,
    MovieSettings,
    check_movie,
    movie_settings,
    mp4,
    stroke_schedule,
    write_movie,
)
from bellcrank.task import find_task
from bellcrank.workflows import find_design
from bellcrank.workflows.animate import MotionOptions, animate_motion, in_one_model, motion_movie
from bellcrank.workflows.loading import loading_path
from bellcrank.workflows.part_figures import part_figures

SMALL = (320, 180)
SETTINGS = MovieSettings(seconds=0.8, fps=25, size=SMALL)
FORMATS = ["mp4", "gif"]


@pytest.fixture(scope="module")
def movie():
    return motion_movie([("human:crane", find_design("human:crane"))], SETTINGS)


@pytest.fixture(scope="module")
def written(movie, tmp_path_factory):
    """The movie in each format."""
    folder = tmp_path_factory.mktemp("written")
    for kind in FORMATS:
        write_movie(movie, folder / f"crane.{kind}", SETTINGS)
    return folder


def truss(force: float) -> Design:
    """Return a shallow von Mises truss, which snaps through at a load between 0.08 and 0.12."""
    problem = Problem(
        name="truss",
        lattice=Lattice([(-1, 0), (0, 0.3), (1, 0), (0, -0.7)], [(0, 1), (1, 2), (1, 3)]),
        supports=Supports(fixed=[0, 2]),
        input=Input([3], (0.0, -1.0), "force", force),
        output=Output([1], (0.0, -1.0)),
        stiffness=Stiffness(5.0, 1e-4),
        designable=[0, 1, 2],
    )
    return problem.full_design()


def decoded(path):
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def spring_energy(problem, u):
    """Return the energy of the springs on the output nodes."""
    output = problem.output
    moved = u[output.nodes]
    if output.spring_kind == "directional":
        moved = (moved * output.direction).sum(axis=1)
    return 0.5 * (output.spring or 0.0) * float((moved**2).sum())


@pytest.mark.parametrize(
    "name", ["machine:crane", "human:crane", "machine:pliers", "machine:discs", "scaling-8"]
)
def test_the_energies_of_the_beams_add_up_to_that_of_the_structure(name):
    design = find_design(name)
    evaluator = SpringEvaluator(design.problem)
    response = evaluator.evaluate(design.mask)
    energy = strain_of(evaluator).energy
    springs = spring_energy(design.problem, response.displacement)
    assert energy.min() >= 0.0
    assert energy.sum() + springs == pytest.approx(response.energy, rel=1e-10)
    assert (energy[~design.mask] == 0.0).all()


def test_the_energies_of_the_beams_of_diluted_lattices_add_up():
    problem = find_design("crane").problem
    evaluator = SpringEvaluator(problem)
    rng = np.random.default_rng(3)
    for _ in range(20):
        mask = problem.initial.copy()
        mask[rng.choice(problem.designable, 60, replace=False)] = False
        response = evaluator.evaluate(mask)
        assert strain_of(evaluator).energy.sum() == pytest.approx(response.energy, rel=1e-10)


def test_the_input_force_is_the_derivative_of_the_energy():
    design = find_design("machine:crane")
    amount, h = design.problem.input.amount, 1e-4

    def at(stroke):
        moved = replace(design.problem, input=replace(design.problem.input, amount=stroke))
        evaluator = SpringEvaluator(moved)
        return evaluator.evaluate(design.mask).energy, strain_of(evaluator).input_force

    slope = (at(amount + h)[0] - at(amount - h)[0]) / (2 * h)
    assert at(amount)[1] == pytest.approx(slope, rel=1e-6)


def test_the_input_force_equals_the_applied_load():
    design = find_design("machine:pliers")
    evaluator = SpringEvaluator(design.problem)
    evaluator.evaluate(design.mask)
    pushed = design.problem.input.amount * len(design.problem.input.nodes)
    assert strain_of(evaluator).input_force == pytest.approx(pushed, rel=1e-8)


@pytest.mark.parametrize("frames", [*range(3, 40), 150, 1001])
def test_a_motion_begins_and_ends_at_rest_and_turns_at_the_full_stroke(frames):
    part, order = stroke_schedule(frames)
    assert len(order) == frames
    assert (part[0], part[-1]) == (0.0, 1.0)
    assert (np.diff(part) > 0.0).all()
    assert part[order[0]] == part[order[-1]] == 0.0
    assert part[order[frames // 2]] == 1.0
    assert np.array_equal(order, order[::-1])
    assert np.array_equal(np.unique(order), np.arange(len(part)))
    assert np.abs(np.diff(order)).max() == 1


def test_a_motion_is_slow_at_its_ends():
    part, _ = stroke_schedule(150)
    pace = np.diff(part)
    assert max(pace[0], pace[-1]) < 0.05 * pace.max()


def test_the_first_frame_is_rest_and_the_middle_one_the_full_stroke(movie):
    sequence = movie.sequences[0]
    design = find_design("human:crane")
    full = SpringEvaluator(design.problem).evaluate(design.mask)
    middle = movie.order[len(movie.order) // 2]
    assert (sequence.displacement[movie.order[0]] == 0.0).all()
    assert np.allclose(sequence.displacement[middle], full.displacement, atol=1e-9)
    assert sequence.energy[middle].sum() == pytest.approx(full.energy, rel=1e-8)
    assert movie.graphs[0].lines[0].y[-1] == pytest.approx(full.efficiency, abs=1e-8)
    assert sequence.notes[middle] == "198 beams · springs · stroke 100 % · efficiency 1.010"


def test_a_frame_is_compared_with_a_frame():
    human, machine = find_design("human:crane"), find_design("machine:crane")
    pairs = [("human:crane", human), ("machine:crane", machine)]
    shown = motion_movie(pairs, SETTINGS)
    assert [sequence.problem.section for sequence in shown.sequences] == [
        machine.problem.section
    ] * 2
    frame = FrameEvaluator(shown.sequences[0].problem).evaluate(human.mask)
    last = shown.graphs[0].lines[0].y[-1]
    assert last == pytest.approx(frame.efficiency, abs=1e-8)
    assert all(" · frame · " in sequence.notes[-1] for sequence in shown.sequences)
    both = [pairs[0], ("crane", human)]
    assert in_one_model(both) == both


def test_the_load_cases_of_a_design_are_shown_side_by_side():
    task = find_task("selector")
    assert task is not None
    short = MovieSettings(seconds=0.4, fps=10, size=SMALL)
    movie = motion_movie([("selector", task.problem.full_design())], short)
    assert [each.title for each in movie.sequences] == ["A", "B"]
    right, up = (
        each.displacement[:, each.problem.output.nodes].mean(axis=1)[-1] for each in movie.sequences
    )
    assert not np.allclose(right, up)
    gain, force = movie.graphs
    assert (gain.x_label, force.y_label) == ("input displacement, mm", "input force, N")
    figures = part_figures(task.problem.full_design(), task.part)
    for line, own in zip(force.lines, figures, strict=True):
        assert line.x[-1] == pytest.approx(3.0)
        assert line.y.max() == pytest.approx(own["largest_input_force_N"], rel=1e-6)
    for line, own in zip(gain.lines, figures, strict=True):
        assert line.y[-1] == pytest.approx(own["efficiency"], rel=1e-6)
    assert all("frame, 8 elements" in each.notes[-1] for each in movie.sequences)


def test_each_frame_shows_the_response_to_a_part_of_the_stroke():
    design = find_design("scaling-8")
    way = loading_path(design, np.array([0.0, 0.3, 1.0]))
    given = replace(design.problem.input, amount=0.3 * design.problem.input.amount)
    response = SpringEvaluator(replace(design.problem, input=given)).evaluate(design.mask)
    assert np.allclose(way.displacement[1], response.displacement, atol=1e-9)
    assert way.efficiency[1] == pytest.approx(response.efficiency, abs=1e-7)
    assert way.efficiency[0] == pytest.approx(way.efficiency[1], rel=0.1)
    assert not way.snapped.any()


def test_the_snap_of_a_design_is_noted_and_leaves_a_gap_in_its_curves():
    design = truss(0.12)
    snapping = motion_movie([("truss", design)], SETTINGS)
    sequence, line = snapping.sequences[0], snapping.graphs[0].lines[0]
    snapped = np.array([bool(alarm) for alarm in sequence.alarms])
    assert not snapped[0]
    assert snapped[-1]
    assert np.count_nonzero(np.diff(snapped)) == 1
    assert sequence.alarms[-1].startswith("snaps at ")
    assert np.count_nonzero(np.isnan(line.y)) == 1
    assert np.isfinite(line.y[line.at]).all()
    assert not any(motion_movie([("truss", truss(0.05))], SETTINGS).sequences[0].alarms)
    MovieFigure(snapping, SMALL).draw(len(snapped) - 1)


def test_a_mechanism_has_no_motion_to_show(tmp_path):
    design = truss(0.1)
    loose = design.with_mask([False, True, True])
    with pytest.raises(InvalidSettings, match=r"^truss: no motion to show: "):
        animate_motion([("truss", loose)], tmp_path / "truss.mp4", SETTINGS)
    assert list(tmp_path.iterdir()) == []


def test_an_mp4_has_the_requested_length_and_size(written):
    path = written / "crane.mp4"
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert (stream.codec_context.width, stream.codec_context.height) == SMALL
        assert stream.average_rate == 25
        assert float(stream.duration * stream.time_base) == pytest.approx(0.8)
    assert len(decoded(path)) == 20
    content = path.read_bytes()
    assert content.index(b"moov") < content.index(b"mdat")


def test_an_mp4_shows_the_drawn_frames(movie, written):
    figure = MovieFigure(movie, SMALL)
    for state, picture in zip(movie.order, decoded(written / "crane.mp4"), strict=True):
        drawn = figure.draw(int(state))[:, :, :3].astype(float)
        assert np.abs(picture - drawn).mean() < 4.0
        assert np.abs((picture - drawn).mean(axis=(0, 1))).max() < 1.0


def test_a_gif_loops_and_has_the_requested_length(written):
    with Image.open(written / "crane.gif") as picture:
        assert picture.size == SMALL
        assert picture.info["loop"] == 0
        lengths = []
        for number in range(picture.n_frames):
            picture.seek(number)
            lengths.append(picture.info["duration"])
    assert sum(lengths) == 800
    assert picture.n_frames > 10


def test_a_gif_shows_the_drawn_frames_on_a_white_background(movie, written):
    figure = MovieFigure(movie, SMALL)
    with Image.open(written / "crane.gif") as picture:
        first = np.array(picture.convert("RGB"), dtype=float)
    drawn = figure.draw(0)[:, :, :3]
    assert np.abs(first - drawn).mean() < 1.5
    assert (first[:3] == 255.0).all()


@pytest.mark.parametrize("fps", [1, 7, 24, 30, 50])
def test_frames_of_a_gif_keep_time(fps):
    from bellcrank.plots.movies.gif import durations

    lengths = durations(5 * fps, fps)
    assert sum(lengths) == 5000
    assert max(lengths) - min(lengths) <= 10


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_movie_is_the_same_file(movie, written, tmp_path, kind):
    write_movie(movie, tmp_path / f"again.{kind}", SETTINGS)
    assert (tmp_path / f"again.{kind}").read_bytes() == (written / f"crane.{kind}").read_bytes()


def test_drawn_and_cached_pictures_make_the_same_file(movie, written, tmp_path, monkeypatch):
    monkeypatch.setattr(mp4, "CACHE_BYTES", 5 * SMALL[0] * SMALL[1])
    write_movie(movie, tmp_path / "again.mp4", SETTINGS)
    assert (tmp_path / "again.mp4").read_bytes() == (written / "crane.mp4").read_bytes()


def test_states_can_be_drawn_in_any_order(movie):
    figure = MovieFigure(movie, SMALL)
    states = np.unique(movie.order)
    forth = [figure.draw(int(state)) for state in states]
    back = [figure.draw(int(state)) for state in states[::-1]][::-1]
    assert all(np.array_equal(a, b) for a, b in zip(forth, back, strict=True))
    assert not np.array_equal(forth[0], forth[-1])


def test_supports_do_not_move_in_the_picture(movie):
    figure = MovieFigure(movie, (960, 540))
    pictures = [figure.draw(int(state)) for state in np.unique(movie.order)]
    support = np.s_[480:]
    assert all(np.array_equal(one[support], pictures[0][support]) for one in pictures)
    assert pictures[0][support].min() < 100


@pytest.mark.parametrize(
    ("name", "size"),
    [("machine:crane", (960, 540)), ("human:pliers", (540, 540)), ("machine:discs", (540, 960))],
)
def test_no_ink_is_cut_off_at_the_edge_of_a_movie(name, size):
    few = MovieSettings(seconds=0.12, fps=25, size=size)
    for designs in ([name], [name, name]):
        whole = motion_movie([(one, find_design(one)) for one in designs], few)
        figure = MovieFigure(whole, size)
        for state in np.unique(whole.order):
            picture = figure.draw(int(state))
            assert picture.shape == (size[1], size[0], 4)
            rim = [picture[:2], picture[-2:], picture[:, :2], picture[:, -2:]]
            assert all((part == 255).all() for part in rim)


def test_designs_side_by_side_share_one_scale_of_colours():
    names = ["human:crane", "machine:crane"]
    both = motion_movie([(name, find_design(name)) for name in names], SETTINGS)
    assert [sequence.title for sequence in both.sequences] == names
    assert [len(graph.lines) for graph in both.graphs] == [2, 2]
    assert MovieFigure(both, SMALL).draw(0).shape == (180, 320, 4)


def test_designs_with_different_drives_are_compared_along_their_strokes():
    names = ["human:crane", "human:pliers"]
    both = motion_movie([(name, find_design(name)) for name in names], SETTINGS)
    assert [graph.x_label for graph in both.graphs] == ["part of the stroke, %"]
    MovieFigure(both, SMALL)


def test_magnified_motion_is_drawn_larger_and_noted():
    design = find_design("human:pliers")
    large = motion_movie([("pliers", design)], SETTINGS, MotionOptions(magnify=2.5)).sequences[0]
    rest = design.problem.lattice.positions
    assert np.allclose(large.moved - rest, 2.5 * large.displacement)
    assert large.notes[-1].startswith("motion drawn × 2.5 · springs · load 100 % · ")


@pytest.mark.parametrize("name", ["movie.avi", "movie", "movie.mp4.txt"])
def test_an_unknown_suffix_is_rejected(movie, tmp_path, name):
    with pytest.raises(InvalidSettings, match=r"expected a movie name ending in \.mp4, \.gif"):
        write_movie(movie, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", FORMATS)
def test_an_existing_movie_is_replaced_on_demand_only(movie, tmp_path, kind):
    path = tmp_path / f"movie.{kind}"
    path.write_text("precious")
    with pytest.raises(OutputExists, match="exists"):
        write_movie(movie, path, SETTINGS)
    assert path.read_text() == "precious"
    write_movie(movie, path, SETTINGS, overwrite=True)
    assert len(path.read_bytes()) > 2000


@pytest.mark.parametrize("kind", FORMATS)
def test_a_missing_folder_is_a_storage_error(movie, tmp_path, kind):
    with pytest.raises(StorageError, match="No such file or directory"):
        write_movie(movie, tmp_path / "missing" / f"movie.{kind}", SETTINGS)


@pytest.mark.parametrize("kind", FORMATS)
def test_a_stop_while_drawing_leaves_nothing(movie, tmp_path, monkeypatch, kind):
    def stop(done):
        if done == 7:
            raise KeyboardInterrupt

    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(KeyboardInterrupt):
        write_movie(movie, tmp_path / f"movie.{kind}", SETTINGS, progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_an_error_of_the_encoder_is_reported(movie, tmp_path, monkeypatch):
    def fail(*_words):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(mp4._VideoStream, "put", fail)
    with pytest.raises(StorageError, match="No space left on device"):
        write_movie(movie, tmp_path / "movie.mp4", SETTINGS)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("kind", "module"), [("mp4", "av"), ("gif", "PIL")])
def test_a_package_that_is_missing_is_named(tmp_path, monkeypatch, kind, module):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InvalidSettings, match="install it with: pip install"):
        check_movie(tmp_path / f"movie.{kind}")


def test_a_missing_encoder_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(mp4, "ENCODERS", {"libnothing264": {}})
    with pytest.raises(InvalidSettings, match=r"no H\.264 encoder \(libnothing264\)"):
        check_movie(tmp_path / "movie.mp4")


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"seconds": 0.0}, "seconds: expected a number above 0, got 0.0"),
        ({"seconds": float("nan")}, "seconds: expected a number above 0, got nan"),
        ({"seconds": float("inf")}, "seconds: expected a number above 0, got inf"),
        ({"seconds": 0.01}, "make 0 frames; expected 3 to 36000"),
        ({"seconds": 1e6}, "expected 3 to 36000"),
        ({"fps": 0}, "fps: expected a whole number from 1 to 120, got 0"),
        ({"fps": 121}, "fps: expected a whole number from 1 to 120, got 121"),
        ({"size": (10, 400)}, "size: expected 96 to 7680 pixels each way, got 10x400"),
        ({"size": (321, 180)}, "size: expected even numbers for an MP4, got 321x180"),
    ],
)
def test_invalid_settings_are_rejected(wrong, message):
    with pytest.raises(InvalidSettings, match=message.replace("(", r"\(")):
        movie_settings("movie.mp4", **{"seconds": 1.0, **wrong})


def test_a_gif_may_have_an_odd_size_and_no_more_frames_than_browsers_show(movie, tmp_path):
    odd = movie_settings("movie.gif", 0.2, size=(321, 181))
    write_movie(movie, tmp_path / "odd.gif", odd)
    with Image.open(io.BytesIO((tmp_path / "odd.gif").read_bytes())) as picture:
        assert picture.size == (321, 181)
    with pytest.raises(InvalidSettings, match="fps: expected at most 50 for a GIF, got 60"):
        movie_settings("movie.gif", 1.0, fps=60)


@pytest.mark.parametrize("field", ["present", "load_bearing", "displacement", "energy", "alarms"])
def test_state_sequences_of_the_wrong_shape_are_rejected(movie, field):
    sequence = movie.sequences[0]
    with pytest.raises(InvalidProblem, match=f"{field}: expected shape"):
        replace(sequence, **{field: getattr(sequence, field)[1:]})


@pytest.mark.parametrize("magnify", [0.0, -1.0, float("nan"), float("inf")])
def test_magnification_must_be_positive_and_finite(movie, magnify):
    with pytest.raises(InvalidSettings, match="magnify: expected a number above 0"):
        replace(movie.sequences[0], magnify=magnify)


def test_unknown_displacements_are_drawn_at_rest(movie):
    sequence = movie.sequences[0]
    lost = replace(sequence, displacement=np.full_like(sequence.displacement, np.nan))
    assert (lost.moved == sequence.problem.lattice.positions).all()


def test_drawing_movies_needs_neither_pyplot_nor_an_encoder():
    code = (
        "import sys, bellcrank.plots.movies; "
        "print([name in sys.modules for name in ('matplotlib.pyplot', 'av')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[False, False]"
