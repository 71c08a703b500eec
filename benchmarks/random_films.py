"""Random films of bundled designs, with and without markers, for `benchmarks.measure`."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.measure.films import needed_picture
from bellcrank.workflows import find_design, spec_for
from bellcrank.workflows.measure import ComputedMotion, computed_motion, layout_for
from benchmarks.cameras import camera_over, moved_by_hand, random_camera
from benchmarks.films import Look, Renderer, Scene, write_film

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Values = NDArray[np.float64]

DESIGNS = (
    "machine:crane", "human:crane", "machine:anti-parallel", "human:anti-parallel",
    "machine:discs", "machine:scaling-8", "machine:gripper",
)  # fmt: skip
PLACEMENT, SHEET = 0.3, 0.0015
"""Standard deviations of the placement of markers, mm, and of the scales of the printed sheet."""
LARGER = 0.15
"""Part of the films that are at least 1920 x 1080 pixels."""
HELD_BY_HAND = 0.15
"""Part of the films with a camera that moves."""


@cache
def computed(name: str) -> ComputedMotion:
    design = find_design(name)
    return computed_motion(design, spec_for(design))


def random_look(rng: np.random.Generator) -> Look:
    """Return a random light, focus and noise."""
    shake = rng.uniform(0.0, 2.0)
    way = rng.uniform(0.0, np.pi)
    return Look(
        blur=rng.uniform(0.5, 1.6),
        streak=(shake * np.cos(way), shake * np.sin(way)),
        light=(rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(0.0, 0.2)),
        noise=rng.uniform(0.003, 0.012),
        part=rng.uniform(0.08, 0.5),
        table=rng.uniform(0.1, 0.6),
        gamma=rng.uniform(1.8, 2.6),
        bend=rng.uniform(0.0, 0.6),
    )


def strokes(rng: np.random.Generator, slower: int = 1) -> Values:
    """Return the fractions of the stroke in the frames: rest, push, hold, and sometimes back.

    Rest and hold last for a quarter to half of a second; the protocol asks for a second each.
    """
    count = slower * int(rng.integers(10, 18))
    reached = rng.uniform(0.85, 1.0)
    ramp = np.linspace(0.0, 1.0, count + 1)[1:]
    ramp = reached * (ramp if rng.random() < 0.5 else 0.5 - 0.5 * np.cos(np.pi * ramp))
    # A hand pushes unevenly.
    ramp = np.sort(np.clip(ramp + rng.normal(0.0, 0.1 / count, count), 0.0, reached))
    rest, hold = int(rng.integers(8, 16)), int(rng.integers(6, 12))
    back = reached * np.linspace(0.9, 0.0, 5) if rng.random() < 0.2 else np.empty(0)
    return np.concatenate([np.zeros(rest), ramp, np.full(hold, reached), back])


def marker_film(number: int, folder: Path) -> tuple[dict[str, Any], Path]:
    """Render a film with markers; return what was rendered."""
    rng = np.random.default_rng([28, number])
    name = DESIGNS[number % len(DESIGNS)]
    own = computed(name)
    layout = layout_for(own)
    size = needed_picture(layout.frame_size, own.full_stroke)
    if rng.random() < LARGER:
        size = max(size, (1920, 1080))
    corners = np.concatenate([marker.corners for marker in layout.reference])
    camera = random_camera(corners.min(axis=0) - 3.0, corners.max(axis=0) + 3.0, size, rng)
    count = len(layout.on_part)
    scene = Scene(
        part=own.part, layout=layout, offsets=rng.normal(0.0, PLACEMENT, (count, 2)),
        angles=rng.normal(0.0, 0.03, count), stretch=1.0 + rng.normal(0.0, SHEET, 2),
        pusher=name != "machine:gripper",
    )  # fmt: skip
    look, fractions = random_look(rng), strokes(rng)
    by_hand = bool(rng.random() < HELD_BY_HAND)
    density = rng.uniform(0.1, 0.3)
    renderer = Renderer(scene, look, rng, samples=3 if size[0] < 1500 else 2)
    cameras = moved_by_hand(camera, len(fractions), rng) if by_hand else [camera] * len(fractions)
    places = own.positions_at(fractions * own.full_stroke)
    path = folder / f"{number}.mp4"
    pictures = (renderer.draw(at, eye) for at, eye in zip(places, cameras, strict=True))
    write_film(pictures, path, density=density)
    tilt = float(np.degrees(np.arccos(-camera.rotation[2, 2])))
    about = {
        "design": name, "size": f"{size[0]}x{size[1]}", "frames": len(fractions),
        "tilt_deg": round(tilt, 1), "blur_px": round(look.blur, 2), "by_hand": by_hand,
    }  # fmt: skip
    return about, path


def outline_film(number: int, folder: Path) -> tuple[dict[str, Any], Path]:
    """Render a film without markers before a plain background; return what was rendered."""
    rng = np.random.default_rng([29, number])
    name = DESIGNS[number % len(DESIGNS)]
    own = computed(name)
    used = np.unique(own.part.struts)
    points = own.positions[:, used].reshape(-1, 2)
    wide, high = np.ptp(points, axis=0).tolist()
    size = needed_picture((wide, high), own.full_stroke)
    camera = random_camera(points.min(axis=0) - 5.0, points.max(axis=0) + 5.0, size, rng)
    look = random_look(rng)
    dark = rng.random() < 0.5
    look = replace(
        look,
        part=rng.uniform(0.05, 0.2) if dark else rng.uniform(0.6, 0.9),
        table=rng.uniform(0.5, 0.9) if dark else rng.uniform(0.05, 0.2),
    )
    fractions = strokes(rng, 2)
    renderer = Renderer(
        Scene(part=own.part, pusher=name != "machine:gripper"), look, rng, samples=2
    )
    path = folder / f"{number}.mp4"
    places = own.positions_at(fractions * own.full_stroke)
    density = rng.uniform(0.1, 0.3)
    write_film((renderer.draw(at, camera) for at in places), path, density=density)
    tilt = float(np.degrees(np.arccos(-camera.rotation[2, 2])))
    about = {
        "design": name, "size": f"{size[0]}x{size[1]}", "frames": len(fractions),
        "tilt_deg": round(tilt, 1), "blur_px": round(look.blur, 2),
    }  # fmt: skip
    return about, path


REFUSED = (
    "no markers", "too few frames", "too blurred", "motion too small", "supports moved",
    "reference markers hidden", "input marker hidden", "pushed at the start",
    "another design", "no contrast", "blurred outline",
)  # fmt: skip


def refused_film(kind: str, folder: Path) -> tuple[str, Path, bool]:
    """Render a film that cannot be measured.

    Returns
    -------
    design
        Design with which it is measured.
    path
        The film.
    outline
        Whether it is measured by the outline.
    """
    rng = np.random.default_rng([30, REFUSED.index(kind)])
    name, size = "human:crane", (960, 540)
    own = computed(name)
    layout = layout_for(own)
    outline = kind in {"no contrast", "blurred outline"}
    fractions = np.concatenate([[0.0, 0.0], np.linspace(0.1, 1.0, 9), [1.0]])
    look = Look(part=0.15, table=0.6)
    if kind == "too few frames":
        fractions = fractions[:4]
    if kind == "motion too small":
        fractions = 0.02 * fractions
    if kind == "pushed at the start":
        fractions = fractions[::-1]
    if kind in {"too blurred", "blurred outline"}:
        look = replace(look, blur=12.0)
    if kind == "no contrast":
        look = replace(look, part=0.55)
    bare = outline or kind == "no markers"
    corners = np.concatenate([marker.corners for marker in layout.reference])
    camera = camera_over(
        corners.min(axis=0) - 3.0, corners.max(axis=0) + 3.0, size, rng, tilt=8.0, focal=0.9,
        distortion=np.zeros(4),
    )  # fmt: skip
    scene = Scene(part=own.part, layout=None if bare else layout)
    renderer = Renderer(scene, look, rng, samples=2)
    pictures = []
    for k, at in enumerate(own.positions_at(fractions * own.full_stroke)):
        moved = kind == "supports moved" and k > 4
        picture = renderer.draw(at, camera, np.tile([1.5, 0.0], (len(at), 1)) if moved else None)
        covered = []
        if kind == "reference markers hidden":
            covered = list(layout.reference[3:])
        if kind == "input marker hidden" and k > 2:
            covered = list(layout.of_role("input"))
        for marker in covered:
            x, y = np.round(camera.project(marker.centre, 0.0)).astype(int)
            picture[max(y - 28, 0) : y + 28, max(x - 28, 0) : x + 28] = 150
        pictures.append(picture)
    path = folder / "film.mp4"
    write_film(iter(pictures), path)
    return "machine:gripper" if kind == "another design" else name, path, outline
