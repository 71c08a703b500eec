"""Measurement of a part without markers: registration of its outline, tracking of its blocks.

The first picture, at rest, is registered with the drawn part (`register`). The blocks of input,
output and supports move nearly as rigid bodies; each is aligned with the first picture by
Gauss-Newton steps for displacement and rotation, from coarse to fine smoothing.

References
----------
S. Baker, I. Matthews, Int. J. Comput. Vis. 56, 221 (2004), alignment of pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import UnreadableFilm
from bellcrank.measure.corners import opencv
from bellcrank.measure.films import LARGEST_BLUR, LEAST_FRAMES, edge_width, grey_of
from bellcrank.measure.layout import Marker, node_blocks
from bellcrank.measure.measurement import Measurement, MeasureSettings, Recording, measured
from bellcrank.measure.motion import part_motion
from bellcrank.measure.registration import contrast_of, register
from bellcrank.measure.tracks import no_report

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.measure.films import Film
    from bellcrank.measure.motion import Motion
    from bellcrank.measure.registration import Registration
    from bellcrank.part import Part

    Values = NDArray[np.float64]
    Picture = NDArray[np.float32]

BLURS = (1.2, 0.5, 0.2)
"""Smoothing of pictures from coarse to fine, mm."""
STEPS = 12
POINTS, ROW = 4000, 256
"""About the largest number of points of a block, and how many are sampled at once."""
LARGEST_MISFIT = 0.25
"""Difference of an aligned block from the first picture, over that of part and background, that
is refused."""
MOVED_SUPPORT = 0.4
"""Motion of the supports that is refused, mm, if it is also a fifth of that of the input."""
FLOOR = 0.05
"""Smallest noise of a position, pixels."""
WALL = 0.35
"""Shift of a block by the sides of the part, over the thickness times the tangent of the tilt."""
LEAST_SHIFT = 0.1
"""Smallest standard deviation of that shift, mm."""
REGISTERED = 0.005
"""Standard deviation of the scales of a registered picture across and up."""
FOCAL = 0.85
"""Typical focal length over the longer side of a picture, for the tilt."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A rigid block of a part, as points at which pictures are compared.

    Parameters
    ----------
    marker
        Role, nodes and centre; its size is that of the square whose corners represent the motion.
    points : (n, 2) float64, mm
        Points on and around the struts of the block, from its centre.
    """

    marker: Marker
    points: Values


def measure_by_outline(
    film: Film,
    part: Part,
    nominal: float,
    settings: MeasureSettings,
    report: Callable[[int, int], None] = no_report,
) -> tuple[Measurement, Registration]:
    """Return the motion of a part without markers, and the camera.

    The camera must stand still. The part lies before a plain background.

    Parameters
    ----------
    film
        The film.
    part
        The part.
    nominal
        Full motion of the input, mm.
    settings
        Number of samples and their seed.
    report
        Called with the numbers of frames read and of all frames.

    Raises
    ------
    UnreadableFilm
        If part and background hardly differ, the part is not found, a block is lost, the
        supports move, or the motion is too small.
    """
    blocks, registration, motions, misfit = _tracked(film, part, report)
    _check_misfit(film, blocks, misfit)
    corners = np.stack([_corners(blocks, row) for row in motions])
    roles = np.array([block.marker.role for block in blocks])
    held = corners[:, roles == "support"].mean(axis=2)
    moving = np.flatnonzero(roles != "support")
    walls = max(WALL * part.section.thickness * np.tan(_tilt(registration)), LEAST_SHIFT)
    markers = [blocks[k].marker for k in moving]
    support = held.mean(axis=1) if held.shape[1] else np.zeros((len(corners), 2))
    shaken = support - support[0]

    def motion_for(rng: np.random.Generator | None, rest: slice) -> Motion:
        squares = corners[:, moving] - shaken[:, None, None]
        offsets = np.zeros((len(moving), 2))
        if rng is not None:
            offsets = walls * rng.standard_normal(offsets.shape)
            squares = squares * (1.0 + REGISTERED * rng.standard_normal(2))
        return part_motion(part, markers, squares, rest, offsets)

    scale = registration.pixels_per_mm
    recording = Recording(film.name, np.arange(len(corners)), scale, FLOOR / scale)
    found = measured(recording, nominal, motion_for, settings)
    _check_supports(film.name, shaken[: found.frames], float(found.stroke[-1]))
    return found, registration


def _tracked(
    film: Film, part: Part, report: Callable[[int, int], None]
) -> tuple[list[Block], Registration, Values, Values]:
    """Return blocks, camera, their motion (F, B, 3) in mm and radians, and misfit (F, B)."""
    blocks: list[Block] = []
    templates: list[list[Values]] = []
    registration: Registration | None = None
    motions: list[Values] = []
    misfits: list[Values] = []
    for number, picture in enumerate(film.pictures()):
        grey = grey_of(picture)
        contrast, level = contrast_of(grey)
        if registration is None:
            width = edge_width(grey)
            if width > LARGEST_BLUR:
                raise UnreadableFilm(
                    f"{film.name}: too blurred: the sharpest edges are {width:.0f} pixels wide; "
                    "focus on the part, hold the camera still and use more light"
                )
            registration = register(film.name, contrast, level, part)
            blocks = rigid_blocks(part, 1.0 / registration.pixels_per_mm)
        smooth = [_smoothed(contrast, blur * registration.pixels_per_mm) for blur in BLURS]
        if not templates:
            templates = [
                [_sampled(each, registration, block, np.zeros(3)) for each in smooth]
                for block in blocks
            ]
            motions.append(np.zeros((len(blocks), 3)))
            misfits.append(np.zeros(len(blocks)))
        else:
            guess = motions[-1]
            if len(motions) > 1:
                guess = guess + (motions[-1] - motions[-2])
            rows = [
                _aligned(smooth, registration, block, template, start)
                for block, template, start in zip(blocks, templates, guess, strict=True)
            ]
            motions.append(np.stack([row for row, _ in rows]))
            misfits.append(np.array([value for _, value in rows]))
        report(number + 1, film.count)
    if registration is None or len(motions) < LEAST_FRAMES:
        raise UnreadableFilm(
            f"{film.name}: {len(motions)} pictures can be read; expected at least {LEAST_FRAMES}"
        )
    return blocks, registration, np.stack(motions), np.stack(misfits)


def rigid_blocks(part: Part, step: float) -> list[Block]:
    """Return the blocks of input, output and supports of a part.

    Parameters
    ----------
    part
        The part.
    step
        Distance of the points, mm.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec
    >>> blocks = rigid_blocks(PartSpec().of(human_design("crane")), 0.5)
    >>> [block.marker.role for block in blocks]
    ['input', 'output', 'support']
    """
    problem = part.design.problem
    held = problem.supports.fixed
    regions = [("input", problem.input.nodes), ("output", problem.output.nodes)]
    if len(np.intersect1d(held, part.struts)):
        regions.append(("support", held))
    blocks = []
    for role, region in regions:
        for nodes in node_blocks(part, region):
            centre = part.positions[nodes].mean(axis=0)
            points = _block_points(part, nodes, step)
            if len(points):
                marker = Marker(0, role, centre, 10.0, nodes)
                blocks.append(Block(marker, points - centre))
    return blocks


def _block_points(part: Part, nodes: NDArray[np.int64], step: float) -> Values:
    """Return points of a grid within 1 mm of the edges of the struts of a block, or inside it."""
    import shapely

    inner = np.isin(part.struts, nodes).all(axis=1)
    if inner.any():
        lines = shapely.multilinestrings(list(part.positions[part.struts[inner]]))
        shape = shapely.buffer(lines, 0.5 * part.section.width + 1.0)
    else:
        shape = shapely.buffer(shapely.multipoints(part.positions[nodes]), part.section.width)
    low_x, low_y, high_x, high_y = shape.bounds
    step = max(step, float(np.sqrt(shape.area / POINTS)))
    grid = np.meshgrid(np.arange(low_x, high_x, step), np.arange(low_y, high_y, step))
    points = np.stack([each.ravel() for each in grid], axis=1)
    shapely.prepare(shape)
    return np.asarray(points[shapely.contains_xy(shape, *points.T)])


def _smoothed(picture: Picture, blur: float) -> Picture:
    return np.asarray(opencv().GaussianBlur(picture, (0, 0), max(blur, 0.7)))


def _sampled(picture: Picture, camera: Registration, block: Block, motion: Values) -> Values:
    """Return the picture at the points of a moved block; nan outside it."""
    cv2 = opencv()
    cosine, sine = np.cos(motion[2]), np.sin(motion[2])
    turned = block.points @ np.array([[cosine, sine], [-sine, cosine]])
    where = camera.pixels(turned + block.marker.centre + motion[:2]).astype(np.float32)
    # As a rectangle, because OpenCV limits the number of rows.
    whole = np.resize(where, (-(-len(where) // ROW), ROW, 2))
    x, y = np.ascontiguousarray(whole[..., 0]), np.ascontiguousarray(whole[..., 1])
    values: Any = cv2.remap(
        picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=float("nan")
    )
    return np.asarray(values, dtype=np.float64).ravel()[: len(where)]


def _aligned(
    pictures: list[Picture], camera: Registration, block: Block, templates: list[Values],
    start: Values,
) -> tuple[Values, float]:  # fmt: skip
    """Return displacement and rotation of a block, and its difference from the first picture."""
    motion, misfit = start.copy(), np.inf
    arm = float(np.sqrt((block.points**2).sum(axis=1).mean()))
    for picture, template, blur in zip(pictures, templates, BLURS, strict=True):
        small = np.array([0.2 * blur, 0.2 * blur, 0.2 * blur / arm])
        for _ in range(STEPS):
            seen = _sampled(picture, camera, block, motion)
            slopes = [
                (_sampled(picture, camera, block, motion + each)
                 - _sampled(picture, camera, block, motion - each)) / (2.0 * small[k])
                for k, each in enumerate(np.diag(small))
            ]  # fmt: skip
            # Gain and offset absorb changes of the light.
            rows = np.stack([*slopes, -template, -np.ones_like(template)], axis=1)
            rest = template - seen
            good = np.isfinite(rows).all(axis=1) & np.isfinite(rest)
            if good.sum() < 0.3 * len(good):
                return start, np.inf
            rows, rest = rows[good], rest[good]
            spread = 1.5 * float(np.median(np.abs(rest))) + 1e-3
            weight = 1.0 / (1.0 + (rest / (3.0 * spread)) ** 2)
            normal = rows.T @ (weight[:, None] * rows)
            normal += np.diag([1e-6 * normal[0, 0]] * 2 + [1e-6 * normal[2, 2], 1e-2, 1e-2])
            change = np.linalg.solve(normal, rows.T @ (weight * rest))[:3]
            limit = 1.5 * blur
            change *= min(
                1.0, limit / max(float(np.hypot(*change[:2])), arm * abs(change[2]), 1e-9)
            )
            motion = motion + change
            misfit = float(np.sqrt((weight * rest**2).sum() / weight.sum()))
            if np.hypot(*change[:2]) + arm * abs(change[2]) < 0.002 * blur:
                break
    return motion, misfit


def _corners(blocks: list[Block], motions: Values) -> Values:
    """Return the corners (B, 4, 2) of the squares of moved blocks."""
    found = []
    for block, (x, y, angle) in zip(blocks, motions.tolist(), strict=True):
        cosine, sine = np.cos(angle), np.sin(angle)
        arms = block.marker.corners - block.marker.centre
        turned = arms @ np.array([[cosine, sine], [-sine, cosine]])
        found.append(block.marker.centre + turned + np.array([x, y]))
    return np.stack(found)


def _tilt(camera: Registration) -> float:
    """Return the angle between the axis of the camera and the normal of the part, radians."""
    size = 2.0 * camera.lens.centre + 1.0
    focal = FOCAL * float(size.max()) / camera.lens.length
    columns = np.diag([1.0 / focal, 1.0 / focal, 1.0]) @ camera.homography[:, :2]
    first, second = (columns / np.linalg.norm(columns, axis=0)).T
    normal = np.cross(first, second)
    return float(np.arccos(np.clip(abs(normal[2]) / np.linalg.norm(normal), 0.0, 1.0)))


def _check_misfit(film: Film, blocks: list[Block], misfit: Values) -> None:
    worst = np.median(misfit, axis=0)
    lost = (misfit > LARGEST_MISFIT).mean(axis=0)
    for block, value, share in zip(blocks, worst.tolist(), lost.tolist(), strict=True):
        if share > 0.2:
            raise UnreadableFilm(
                f"{film.name}: the {block.marker.role} is lost in {share:.0%} of the pictures "
                f"(difference {value:.2f} of the contrast); move the input more slowly, keep hands "
                "off the part, or use markers"
            )


def _check_supports(name: str, shaken: Values, stroke: float) -> None:
    most = float(np.linalg.norm(shaken, axis=1).max())
    if most > max(MOVED_SUPPORT, 0.2 * stroke):
        raise UnreadableFilm(
            f"{name}: supports moved: they move {most:.2f} mm in the picture while the input moves "
            f"{stroke:.2f} mm; clamp them and keep the camera still"
        )
