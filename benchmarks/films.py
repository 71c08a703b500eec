"""Rendered films of parts that deform, for `benchmarks.measure` and the tests.

The pictures do not use the code that measures them. A camera (`benchmarks.cameras`) sees a sheet
and a part of finite thickness above it. Each pixel is the mean of nine points, or of four in large
pictures; markers are sampled exactly, by intersecting the ray of each point with their plane. Then
follow a point spread (defocus and a streak), uneven light, vignetting, noise of photons and of the
sensor, the gamma of the camera, and H.264.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.measure import MarkerLayout
    from bellcrank.part import Part
    from benchmarks.cameras import Camera

    Values = NDArray[np.float64]

SLICES = 5
"""Number of planes that draw the sides of the part."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """Light, focus and noise of a film.

    Parameters
    ----------
    blur
        Standard deviation of the point spread, pixels.
    streak : (2,)
        Shake during a picture, pixels.
    light : (3,)
        Change of the light from left to right and from top to bottom, and vignetting.
    noise
        Standard deviation of the sensor over its full range; that of photons is proportional to
        the square root of the light.
    part, table
        Reflectance of the part and of what is around the sheet.
    gamma
        Exponent of the response of the camera.
    bend
        Strength of an S-shaped change of this response, as cameras add for contrast.
    """

    blur: float = 0.8
    streak: tuple[float, float] = (0.0, 0.0)
    light: tuple[float, float, float] = (0.2, -0.1, 0.1)
    noise: float = 0.01
    part: float = 0.25
    table: float = 0.35
    gamma: float = 2.2
    bend: float = 0.3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A part on a sheet.

    Parameters
    ----------
    part
        The part at rest.
    layout
        Markers; None for a part without markers before a plain background.
    offsets, angles : (K, 2), mm, and (K,), radians
        How the markers on the part are glued: displaced and turned.
    stretch : (2,)
        Width and height of the printed sheet over the drawn ones.
    pusher
        Whether something pushes the input.
    """

    part: Part
    layout: MarkerLayout | None = None
    offsets: Values | None = None
    angles: Values | None = None
    stretch: Values = field(default_factory=lambda: np.ones(2))
    pusher: bool = True


class Renderer:
    """Draws a scene.

    Parameters
    ----------
    scene, look
        What is seen, and how.
    samples
        Number of samples of a pixel each way.
    rng
        Noise of the pictures.
    """

    def __init__(self, scene: Scene, look: Look, rng: np.random.Generator, samples: int = 3):
        self.scene, self.look, self.samples, self.rng = scene, look, samples, rng
        self._camera: Camera | None = None
        self._last: tuple[Values, Any] | None = None
        ramp = np.linspace(0.0, 1.0, 2**15) ** (1 / look.gamma)
        bent = ramp + look.bend * ramp * (1 - ramp) * (2 * ramp - 1)
        self._curve = np.round(255 * bent).astype(np.uint8)
        self._pool = rng.standard_normal(2**23, dtype=np.float32)

    def draw(self, positions: Values, camera: Camera, shift: Values | None = None) -> Any:
        """Return a picture (height, width), uint8.

        Parameters
        ----------
        positions : (N, 2), mm
            Nodes of the part.
        camera
            The camera.
        shift : (N, 2), mm, optional
            A motion of the whole part that is added, such as of a loose support.
        """
        if self._camera is not camera:
            self._set_camera(camera)
            self._last = None
        where = positions if shift is None else positions + shift
        if self._last is None or not np.array_equal(self._last[0], where):
            canvas = self._background.copy()
            self._draw_part(canvas, where)
            if self.scene.layout is not None:
                self._draw_cards(canvas, where)
            self._last = (where, self._blurred(canvas))
        return self._exposed(self._last[1])

    def _set_camera(self, camera: Camera) -> None:
        self._camera = camera
        self._map = camera.fine_map(self.samples)
        high, wide = self._map.shape[:2]
        self._background = np.full((high, wide), _level(self.look.table), dtype=np.uint8)
        if self.scene.layout is not None:
            low = self.scene.layout.corner * self.scene.stretch
            top = low + self.scene.layout.extent * self.scene.stretch
            inside = ((self._map > low) & (self._map < top)).all(axis=-1)
            self._background[inside] = _level(0.88)
            for marker in self.scene.layout.reference:
                self._stamp(
                    self._background, marker.id, marker.size, marker.centre, 0.0, 0.0,
                    self.scene.stretch,
                )  # fmt: skip

    def _stamp(
        self, canvas: Any, number: int, size: float, centre: Values, angle: float, height: float,
        stretch: Values, margin: float = 0.0,
    ) -> None:  # fmt: skip
        """Draw a marker in a plane above the sheet, with a white margin."""
        camera = self._camera
        half = 0.5 * size + margin
        cosine, sine = np.cos(angle), np.sin(angle)
        turn = np.array([[cosine, sine], [-sine, cosine]])
        corners = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ turn
        middle = centre * stretch
        seen = camera.project(middle + 1.01 * corners, height) * self.samples
        low = np.maximum(np.floor(seen.min(axis=0)).astype(int) - 4, 0)
        top = np.ceil(seen.max(axis=0)).astype(int) + 5
        window = (slice(low[1], top[1]), slice(low[0], top[0]))
        sheet = self._map[window]
        if not sheet.size:
            return
        foot, far = camera.position[:2], camera.position[2]
        # A plane above the sheet is seen scaled about the foot of the camera.
        ratio = (far - height) / far
        shift = (foot - ratio * foot - middle) / stretch
        points = sheet * (ratio / stretch).astype(np.float32) + shift.astype(np.float32)
        u = cosine * points[..., 0] + sine * points[..., 1]
        v = cosine * points[..., 1] - sine * points[..., 0]
        card = (np.abs(u) < half) & (np.abs(v) < half)
        canvas[window][card] = _level(0.88)
        inside = (np.abs(u) < 0.5 * size) & (np.abs(v) < 0.5 * size)
        column = np.clip(((u / size + 0.5) * 6).astype(int), 0, 5)
        row = np.clip(((0.5 - v / size) * 6).astype(int), 0, 5)
        white = _modules(number)[row, column]
        canvas[window][inside] = np.where(white, _level(0.88), _level(0.05))[inside]

    def _draw_part(self, canvas: Any, positions: Values) -> None:
        part, camera = self.scene.part, self._camera
        height = part.section.thickness
        shapes = _strut_shapes(positions, part.struts, part.widths)
        block = _pads(positions, part)
        if self.scene.pusher:
            shapes.append(_pusher(positions, part))
        counts = np.cumsum([len(shape) for shape in (*shapes, *block)])[:-1]
        points = np.concatenate([*shapes, *block])
        for level in np.linspace(0.0, 1.0, SLICES):
            shade = self.look.part * (0.65 if level < 1.0 else 1.0)
            fine = (camera.project(points, level * height) + 0.5) * self.samples - 0.5
            for seen in np.split(np.round(fine * 16).astype(np.int32), counts):
                cv2.fillPoly(canvas, [seen], _level(shade), shift=4)

    def _draw_cards(self, canvas: Any, positions: Values) -> None:
        layout, part = self.scene.layout, self.scene.part
        rest = part.positions
        for k, marker in enumerate(layout.on_part):
            before, after = rest[marker.nodes], positions[marker.nodes]
            angle = _turned(before, after)
            offset = np.zeros(2) if self.scene.offsets is None else self.scene.offsets[k]
            glued = 0.0 if self.scene.angles is None else float(self.scene.angles[k])
            cosine, sine = np.cos(angle), np.sin(angle)
            arm = marker.centre + offset - before.mean(axis=0)
            arm = np.array([cosine * arm[0] - sine * arm[1], sine * arm[0] + cosine * arm[1]])
            self._stamp(
                canvas, marker.id, marker.size, after.mean(axis=0) + arm, angle + glued,
                part.section.thickness, np.ones(2), margin=marker.size / 6,
            )  # fmt: skip

    def _blurred(self, canvas: Any) -> Any:
        """Return the light of a picture without noise."""
        look, (wide, high) = self.look, self._camera.size
        picture = cv2.resize(canvas, (wide, high), interpolation=cv2.INTER_AREA).astype(np.float32)
        picture /= 255.0
        picture = cv2.GaussianBlur(picture, (0, 0), max(look.blur, 1e-3))
        streak = float(np.hypot(*look.streak))
        if streak > 0.3:
            picture = cv2.filter2D(picture, -1, _line_kernel(look.streak))
        y = np.linspace(-1, 1, high, dtype=np.float32)[:, None]
        x = np.linspace(-1, 1, wide, dtype=np.float32)[None]
        light = 1.0 + look.light[0] * x + look.light[1] * y - look.light[2] * (x * x + y * y)
        return picture * (0.85 * light)

    def _exposed(self, picture: Any) -> Any:
        """Return the grey levels of a picture with noise."""
        look = self.look
        start = int(self.rng.integers(0, len(self._pool) - picture.size))
        noise = self._pool[start : start + picture.size].reshape(picture.shape)
        picture = picture + noise * np.sqrt(look.noise**2 * (0.3 + 3.0 * np.clip(picture, 0, None)))
        level = (np.clip(picture, 0, 1) * (len(self._curve) - 1)).astype(np.uint16)
        return self._curve[level]


def _level(reflectance: float) -> int:
    return round(255 * reflectance)


def _modules(number: int) -> NDArray[np.bool_]:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    return cv2.aruco.generateImageMarker(dictionary, number, 6) > 127


def _turned(before: Values, after: Values) -> float:
    """Return the angle by which points turn, radians."""
    if len(before) < 2:
        return 0.0
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    return float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))


def _strut_shapes(positions: Values, struts: Any, widths: Values) -> list[Values]:
    """Return the outline of each strut with round ends."""
    ends = positions[struts]
    along = ends[:, 1] - ends[:, 0]
    angle = np.arctan2(along[:, 1], along[:, 0])
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9)
    shapes = []
    for (start, end), way, width in zip(ends, angle.tolist(), widths.tolist(), strict=True):
        cap = 0.5 * width * np.stack([np.cos(turn + way), np.sin(turn + way)], axis=-1)
        shapes.append(np.concatenate([end + cap, start - cap]))
    return shapes


def _pads(positions: Values, part: Part) -> list[Values]:
    """Return triangles that fill the supports and the input (`export --plate --pad`)."""
    problem = part.design.problem
    filled = []
    for nodes in (problem.supports.nodes, problem.input.nodes):
        pairs = {
            tuple(sorted(pair)) for pair in part.struts.tolist() if set(pair) <= {*nodes.tolist()}
        }
        close: dict[int, set[int]] = {}
        for first, second in pairs:
            close.setdefault(first, set()).add(second)
        for first, second in pairs:
            for third in close.get(first, set()) & close.get(second, set()):
                filled.append(positions[[first, second, third]])  # noqa: PERF401
    return filled


def _pusher(positions: Values, part: Part) -> Values:
    """Return a rod that pushes the input from outside."""
    given = part.design.problem.input
    rest, now = part.positions[given.nodes], positions[given.nodes]
    way = given.direction.mean(axis=0)
    way = way / np.linalg.norm(way)
    side = np.array([-way[1], way[0]])
    start = now.mean(axis=0) + way * (((rest - rest.mean(axis=0)) @ way).min() - 1.0)
    return np.stack(
        [
            start - 3 * side,
            start + 3 * side,
            start + 3 * side - 60 * way,
            start - 3 * side - 60 * way,
        ]
    )


def _line_kernel(streak: tuple[float, float]) -> NDArray[np.float32]:
    half = int(np.ceil(0.5 * np.hypot(*streak))) + 1
    kernel = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
    for share in np.linspace(-0.5, 0.5, 41):
        x, y = half + share * streak[0], half + share * streak[1]
        i, j = int(np.floor(y)), int(np.floor(x))
        u, v = y - i, x - j
        corner = np.array([[(1 - u) * (1 - v), (1 - u) * v], [u * (1 - v), u * v]])
        kernel[i : i + 2, j : j + 2] += corner
    return kernel / kernel.sum()


def write_film(pictures: Iterator[Any], path: Path, rate: int = 30, density: float = 0.2) -> None:
    """Write grey pictures as H.264.

    Parameters
    ----------
    density
        Bits for each pixel; phones write 0.1 to 0.3.
    """
    import av

    with av.open(str(path), "w") as container:
        stream = None
        for picture in pictures:
            if stream is None:
                stream = container.add_stream("libx264", rate=rate, options={"preset": "veryfast"})
                stream.height, stream.width = picture.shape
                stream.bit_rate = round(density * rate * picture.size)
                stream.pix_fmt = "yuv420p"
                stream.codec_context.thread_count = 1
            # Studio range, without colour.
            planes = np.full((picture.shape[0] * 3 // 2, picture.shape[1]), 128, dtype=np.uint8)
            planes[: picture.shape[0]] = 16 + np.round(picture * (219.0 / 255.0))
            container.mux(stream.encode(av.VideoFrame.from_ndarray(planes, format="yuv420p")))
        if stream is not None:
            container.mux(stream.encode(None))
