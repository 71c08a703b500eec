"""Pictures of designs in space."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib.colors
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from PIL import Image

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.model import (
    Design,
    Input,
    Output,
    Problem,
    Section,
    Supports,
    find_problem,
    lattices,
)
from bellcrank.plots import Motion, draw_cases, draw_design, draw_motion, style
from bellcrank.plots.marks import add_panel
from bellcrank.plots.movies import MovieSettings
from bellcrank.plots.space import (
    VIEW,
    add_drawing_in_space,
    arrows_in_space,
    frame_in_space,
    view_from,
)
from bellcrank.workflows.animate import motion_movie

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def design() -> Design:
    lattice = lattices["octet"]([3, 3, 3])
    problem = Problem(
        name="block",
        lattice=lattice,
        supports=Supports(fixed=np.flatnonzero(lattice.positions[:, 2] < 0.2)),
        input=Input([lattice.node_count - 1], [0, 0, -1], "displacement", 0.1),
        output=Output([lattice.node_count - 5], [-1, 0, 0]),
        section=Section.round(0.2),
    )
    return problem.full_design()


def test_a_view_is_a_rotation_that_keeps_up_upward() -> None:
    for azimuth, elevation in ((0, 0), (30, 20), (-120, 60)):
        axes = np.array(view_from(azimuth, elevation)[:3])
        assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        assert axes[1, 2] > 0.0
    # From the right, what is behind is on the right.
    assert view_from(90.0, 0.0).screen(np.array([0.0, 1.0, 0.0])) == pytest.approx([1.0, 0.0])
    assert view_from(0.0, 90.0).toward == pytest.approx([0.0, 0.0, 1.0])


def test_everything_drawn_is_in_the_frame(design: Design) -> None:
    moved = np.full((63, 3), 0.3)
    motion = Motion(design, moved, 1.0)
    low, high = frame_in_space(motion)
    for points in (design.problem.lattice.positions, motion.moved):
        seen = VIEW.screen(points)
        assert (seen > low).all()
        assert (seen < high).all()
    for arrow in arrows_in_space(motion):
        assert (np.array([arrow.tail, arrow.tip]) > low).all()
        assert (np.array([arrow.tail, arrow.tip]) < high).all()


def test_near_struts_are_darker_and_drawn_later(design: Design) -> None:
    figure = style.new_figure(4, 4)
    motion = Motion(design, np.zeros((63, 3)), 1.0)
    panel = add_panel(figure, design.problem, (0, 0), 0.5, *frame_in_space(motion))
    add_drawing_in_space(panel, motion, displaced=False)
    (shaded,) = [
        each
        for each in panel.axes.collections
        if isinstance(each, LineCollection) and len(each.get_colors()) > 1
    ]
    grey = matplotlib.colors.to_rgba_array(shaded.get_colors())[1::2, :3].mean(axis=1)
    assert (np.diff(grey) <= 1e-12).all()
    assert grey[0] - grey[-1] > 0.5


def test_pictures_are_written(design: Design, tmp_path: Path) -> None:
    motion = Motion(design, np.full((63, 3), 0.1), 1.2, name="block")
    with_path = Motion(
        design, np.full((63, 3), 0.1), 1.2, paths=(np.array([[0, 0, 0], [-0.5, 0.1, 0.2]]),)
    )
    draw_motion(motion, tmp_path / "motion.png")
    draw_cases([motion, with_path], tmp_path / "cases.png")
    draw_design(design, tmp_path / "rest.png")
    for name in ("motion", "cases", "rest"):
        picture = np.asarray(Image.open(tmp_path / f"{name}.png").convert("L"))
        assert (picture < 80).mean() > 0.01


def test_a_displacement_in_the_plane_is_refused(design: Design) -> None:
    with pytest.raises(InvalidProblem, match=r"displacement: expected shape \(63, 3\)"):
        Motion(design, np.zeros((63, 2)))


def test_a_movie_shows_a_part_in_space_with_a_turning_camera(design: Design) -> None:
    from bellcrank.plots.movies.figure import MovieFigure
    from bellcrank.plots.movies.space_artist import view_at, whole_frame

    movie = motion_movie([("block", design)], MovieSettings(seconds=0.5, fps=10))
    (sequence,) = movie.sequences
    states = len(sequence.notes)
    assert not np.allclose(view_at(sequence, 0).right, view_at(sequence, states - 1).right)
    low, high = whole_frame(sequence)
    for state in range(states):
        seen = view_at(sequence, state).screen(sequence.moved[state])
        assert (seen > low).all()
        assert (seen < high).all()
    figure = MovieFigure(movie, (640, 360))
    first, last = (figure.draw(state)[..., :3] for state in (0, states - 1))
    assert (first != last).any(axis=2).mean() > 0.05


def test_a_movie_shows_designs_of_one_dimension(design: Design) -> None:
    crane = find_problem("crane").full_design()
    with pytest.raises(InvalidSettings, match="in the plane or in space, got both"):
        motion_movie([("block", design), ("crane", crane)], MovieSettings())
