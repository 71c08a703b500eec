"""Measurement of printed parts from films, beside the computed motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.results import finite
from bellcrank.measure import (
    MarkerLayout,
    Measurement,
    MeasureSettings,
    Motion,
    Tracks,
    interval,
    marker_layout,
    measure_by_markers,
    motion_of_nodes,
    track_markers,
)
from bellcrank.measure.measurement import FRACTIONS
from bellcrank.measure.tracks import no_report
from bellcrank.model import require_plane
from bellcrank.part import frame_problem
from bellcrank.provenance import provenance
from bellcrank.search.verification import ELEMENTS
from bellcrank.workflows.figures import model_words
from bellcrank.workflows.loading import loading_path

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.measure import Film
    from bellcrank.measure.registration import Registration
    from bellcrank.model import Design
    from bellcrank.part import Part, PartSpec

    Values = NDArray[np.float64]

STATES = 17
"""Number of computed states, rest included."""
SCHEMA = "bellcrank/measurement/1"


@dataclass(frozen=True, slots=True, eq=False)
class ComputedMotion:
    """Motion of a part by frames, from rest to the full stroke.

    Parameters
    ----------
    part
        The part.
    positions : (K, N, 2) float64, mm
        Positions of the nodes.
    motion
        Motion of input and output in these K states.
    model
        The mechanical model in words.
    """

    part: Part
    positions: Values
    motion: Motion
    model: str

    @property
    def full_stroke(self) -> float:
        """Motion of the input at the end, mm."""
        return float(self.motion.input[-1])

    def at(self, stroke: Values) -> Values:
        """Return along, across (2), rotation and path (2), (A, 6), at input motions in mm."""
        return np.asarray(self._spline(self.motion.columns[:, 1:])(stroke))

    def positions_at(self, stroke: Values) -> Values:
        """Return the positions of the nodes (A, N, 2), mm, at input motions in mm."""
        return np.asarray(self._spline(self.positions)(np.clip(stroke, 0.0, self.full_stroke)))

    def _spline(self, values: Values) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.motion.input, values, axis=0)


def check_measurable(design: Design) -> None:
    """Check that a film shows the efficiency of a design.

    Raises
    ------
    InvalidProblem
        If the part is in space.
    InvalidSettings
        If the input is a force.
    """
    require_plane(design.problem, "measurements")
    if design.problem.input.drive != "displacement":
        raise InvalidSettings(
            f"{design.problem.name}: the input is a force, which a film does not show; expected a "
            "design whose input is a displacement"
        )


def computed_motion(
    design: Design, spec: PartSpec, report: Callable[[int], None] = lambda _done: None
) -> ComputedMotion:
    """Return the motion of a planar design as a part, by frames of 8 elements.

    Raises
    ------
    InvalidProblem
        If the part is in space.
    InvalidSettings
        If the input is a force or turns back on the way, or there is no stable equilibrium at
        the full stroke.
    """
    check_measurable(design)
    if design.problem.section is None:
        design = replace(design, problem=frame_problem(design.problem, spec))
    part, problem = spec.of(design), design.problem
    path = loading_path(design, np.linspace(0.0, 1.0, STATES), report=report, elements=ELEMENTS)
    moved = part.scale * path.displacement
    motion = motion_of_nodes(
        problem, moved[:, problem.input.nodes], moved[:, problem.output.nodes], part.scale
    )
    if not (np.diff(motion.input) > 0.0).all():
        raise InvalidSettings(
            f"{problem.name}: the input does not move steadily along its direction, so that the "
            "motion cannot be given over that of the input"
        )
    return ComputedMotion(part, part.positions + moved, motion, model_words(problem, ELEMENTS))


def layout_for(computed: ComputedMotion, size: float | None = None) -> MarkerLayout:
    """Return the markers of a part, with room for its motion."""
    sizes = {} if size is None else {"size": size}
    return marker_layout(computed.part, computed.positions, **sizes)


@dataclass(frozen=True, slots=True, eq=False)
class FilmResult:
    """A measurement beside the computed motion.

    Parameters
    ----------
    film
        The film.
    computed
        Computed motion.
    measurement
        Figures with their standard deviations.
    camera
        Tracks of the markers, or the registration of the outline.
    method
        ``"markers"`` or ``"outline"``.
    """

    film: Film
    computed: ComputedMotion
    measurement: Measurement
    camera: Tracks | Registration
    method: str


def measure_film(
    film: Film,
    computed: ComputedMotion,
    layout: MarkerLayout | None = None,
    *,
    settings: MeasureSettings | None = None,
    printed: Values | None = None,
    report: Callable[[int, int], None] = no_report,
) -> FilmResult:
    """Measure the motion of a part in a film with markers.

    Parameters
    ----------
    film
        The film.
    computed
        Computed motion of the design.
    layout
        Markers of the part; those of `layout_for` by default.
    settings
        Systematic errors and bootstrap.
    printed : (2,), optional
        Width and height of the printed sheet over the drawn ones.
    report
        Called with the numbers of frames read and of all frames.

    Raises
    ------
    UnreadableFilm, InvalidFile
        If the film cannot be measured.
    """
    chosen = layout or layout_for(computed)
    tracks = track_markers(film, chosen, printed, report)
    found = measure_by_markers(
        film.name, computed.part, tracks, computed.full_stroke, settings or MeasureSettings()
    )
    return FilmResult(film, computed, found, tracks, "markers")


def measure_outline(
    film: Film,
    computed: ComputedMotion,
    *,
    settings: MeasureSettings | None = None,
    report: Callable[[int, int], None] = no_report,
) -> FilmResult:
    """Measure the motion of a part without markers; arguments and errors as `measure_film`."""
    from bellcrank.measure.by_outline import measure_by_outline

    found, camera = measure_by_outline(
        film, computed.part, computed.full_stroke, settings or MeasureSettings(), report
    )
    return FilmResult(film, computed, found, camera, "outline")


def printed_scale(layout: MarkerLayout, size: tuple[float, float]) -> Values:
    """Return (2,) the measured width and height of a printed sheet over the drawn ones.

    Raises
    ------
    InvalidSettings
        If they deviate by more than a tenth: the sheet is not that of the layout.
    """
    ratio = np.array(size) / np.array(layout.frame_size)
    if np.abs(ratio - 1.0).max() > 0.1:
        wide, high = layout.frame_size
        raise InvalidSettings(
            f"sheet: {size[0]:g} x {size[1]:g} mm; the corner markers of this design are drawn "
            f"{wide:.1f} x {high:.1f} mm apart over their outer edges"
        )
    return np.asarray(ratio, dtype=np.float64)


def result_data(result: FilmResult) -> dict[str, Any]:
    """Return a result as plain data, with units in the keys."""
    found, computed = result.measurement, result.computed
    expected = computed.at(found.stroke)
    rows = []
    for k, stroke in enumerate(found.stroke.tolist()):
        along, x, y, rotation = expected[k, :4].tolist()
        row: dict[str, Any] = {
            "fraction": float(FRACTIONS[k]),
            "input_mm": stroke,
            "efficiency": _figure(found.efficiency[k], along / stroke),
            "off_axis": _figure(found.off_axis[k], float(np.hypot(x, y)) / abs(along), lowest=0.0),
            "rotation_deg": _figure(found.rotation[k], rotation),
            "path_mm": [
                _figure(found.path[k, axis], float(expected[k, 4 + axis])) for axis in (0, 1)
            ],
        }
        rows.append(row)
    motion = found.motion
    return {
        "schema": SCHEMA,
        "design": computed.part.design.problem.name,
        "film": result.film.name,
        "method": result.method,
        "model": computed.model,
        "full_stroke_mm": computed.full_stroke,
        "reached_mm": float(found.stroke[-1]),
        "efficiency": rows[-1]["efficiency"],
        "strokes": rows,
        "frames": {"read": result.film.count, "used": found.frames},
        "pixels_per_mm": found.pixels_per_mm,
        "input_noise_mm": found.noise,
        "measured_motion": {
            "frame": found.frame_numbers.tolist(),
            "input_mm": np.round(motion.input, 4).tolist(),
            "along_mm": np.round(motion.along, 4).tolist(),
            "across_mm": np.round(motion.across, 4).tolist(),
            "rotation_deg": [finite(each) for each in np.round(motion.rotation, 3).tolist()],
        },
        "provenance": provenance(),
    }


def _figure(value: Values, computed: float, lowest: float = -np.inf) -> dict[str, Any]:
    low, high = interval(value)
    return {
        "measured": finite(float(value[0])), "low": finite(max(low, lowest)),
        "high": finite(high), "computed": finite(computed),
    }  # fmt: skip
