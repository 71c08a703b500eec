"""Measurements from rendered films against what was rendered: ``python -m benchmarks.measure``.

Films of bundled designs that deform as computed by frames are rendered (`benchmarks.films`),
written as H.264, and measured like films of printed parts: with markers, and without markers by
the outline. Tilt, light, focus, noise, lens, size and number of pictures, placement of the markers
and the scale of the printed sheet are random. Films that cannot be measured must be refused. The
record is ``docs/benchmarks/measure.json``; films that are in it are not made again.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from bellcrank.errors import UnreadableFilm
from bellcrank.measure import MeasureSettings, open_film
from bellcrank.measure.films import needed_picture
from bellcrank.provenance import provenance
from bellcrank.workflows import find_design, spec_for
from bellcrank.workflows.measure import (
    ComputedMotion,
    computed_motion,
    layout_for,
    measure_film,
    measure_outline,
    result_data,
)
from benchmarks.films import Camera, Look, Renderer, Scene, camera_over, write_film

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Values = NDArray[np.float64]

PAGE = Path(__file__).parents[1] / "docs" / "measure.md"
HEAD = (
    "| method | design | films | accurate | truth in the interval | median deviation | "
    "median half width |"
)
RULE = "|---|---|---|---|---|---|---|"
RECORD = Path(__file__).parents[1] / "docs" / "benchmarks" / "measure.json"
DESIGNS = (
    "machine:crane", "human:crane", "machine:anti-parallel", "human:anti-parallel",
    "machine:discs", "machine:scaling-8", "machine:gripper",
)  # fmt: skip
FILMS, OUTLINES = 200, 42
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


def random_camera(
    low: Values, high: Values, size: tuple[int, int], rng: np.random.Generator
) -> Camera:
    """Return a random camera: up to 20 degrees of tilt, and distortion as of phones and more."""
    distortion = [rng.uniform(-0.08, 0.06), rng.uniform(-0.02, 0.02), *rng.normal(0.0, 2e-4, 2)]
    return camera_over(
        low, high, size, rng, tilt=rng.uniform(0.0, 20.0), focal=rng.uniform(0.72, 1.1),
        distortion=np.array(distortion),
    )  # fmt: skip


def strokes(rng: np.random.Generator, slower: int = 1) -> Values:
    """Return the fractions of the stroke in the frames: rest, push, hold, and sometimes back.

    Rest and hold last for a quarter to half of a second; the protocol asks for a second each.
    """
    count = slower * int(rng.integers(10, 18))
    reached = rng.uniform(0.85, 1.0)
    ramp = np.linspace(0.0, 1.0, count + 1)[1:]
    ramp = reached * (ramp if rng.random() < 0.5 else 0.5 - 0.5 * np.cos(np.pi * ramp))
    # Nobody pushes evenly.
    ramp = np.sort(np.clip(ramp + rng.normal(0.0, 0.1 / count, count), 0.0, reached))
    rest, hold = int(rng.integers(8, 16)), int(rng.integers(6, 12))
    back = reached * np.linspace(0.9, 0.0, 5) if rng.random() < 0.2 else np.empty(0)
    return np.concatenate([np.zeros(rest), ramp, np.full(hold, reached), back])


def moved_by_hand(camera: Camera, count: int, rng: np.random.Generator) -> Iterator[Camera]:
    """Yield cameras that move by some mm and tenths of a degree."""
    position, turn = camera.position, np.zeros(3)
    for _ in range(count):
        position = position + rng.normal(0.0, 0.6, 3)
        turn = turn + rng.normal(0.0, 6e-4, 3)
        yield Camera(
            size=camera.size, focal=camera.focal, principal=camera.principal,
            distortion=camera.distortion, rotation=cv2.Rodrigues(turn)[0] @ camera.rotation,
            position=position,
        )  # fmt: skip


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


def measured_film(number: int) -> dict[str, Any]:
    """Render and measure one film with markers."""
    with TemporaryDirectory() as folder:
        about, path = marker_film(number, Path(folder))
        start = time.perf_counter()
        data = result_data(
            measure_film(
                open_film([path]), computed(about["design"]),
                settings=MeasureSettings(placement=PLACEMENT, sheet=SHEET),
            )
        )  # fmt: skip
    seconds = time.perf_counter() - start
    return {**about, **figures(data), "seconds": round(seconds, 2)}


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


def measured_outline(number: int) -> dict[str, Any]:
    """Render and measure one film without markers."""
    with TemporaryDirectory() as folder:
        about, path = outline_film(number, Path(folder))
        start = time.perf_counter()
        data = result_data(measure_outline(open_film([path]), computed(about["design"])))
    seconds = time.perf_counter() - start
    return {**about, **figures(data), "seconds": round(seconds, 2)}


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


def refusal(kind: str) -> str:
    """Return the reason for which a film of a kind is refused; empty if it is not."""
    with TemporaryDirectory() as folder:
        name, path, outline = refused_film(kind, Path(folder))
        try:
            film = open_film([path])
            if outline:
                measure_outline(film, computed(name))
            else:
                measure_film(film, computed(name))
        except UnreadableFilm as error:
            return str(error).partition(": ")[2]
    return ""


def figures(data: dict[str, Any]) -> dict[str, Any]:
    """Return true and measured figures at the full stroke that was reached."""
    last = data["strokes"][-1]
    row = {"input_mm": round(last["input_mm"], 4), "pixels_per_mm": round(data["pixels_per_mm"], 2)}
    for key in ("efficiency", "off_axis", "rotation_deg"):
        each = last[key]
        row[key] = [_short(each[name]) for name in ("computed", "measured", "low", "high")]
    return row


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.5g}")


def main() -> None:
    """Render, measure, record and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--films", type=int, default=FILMS, help="number of films with markers")
    parser.add_argument("--outlines", type=int, default=OUTLINES, help="number without markers")
    parser.add_argument("--out", type=Path, default=RECORD, help="record")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    record: dict[str, Any] = {"markers": {}, "outline": {}, "refused": {}}
    if options.out.exists():
        record = json.loads(options.out.read_text(encoding="utf-8"))
    jobs = {
        "markers": (measured_film, options.films),
        "outline": (measured_outline, options.outlines),
    }
    for kind, (job, count) in jobs.items():
        for number in range(count):
            if str(number) in record[kind]:
                continue
            try:
                row = job(number)
            except ValueError as error:
                row = {
                    "design": DESIGNS[number % len(DESIGNS)],
                    "error": str(error).partition(": ")[2],
                }
            record[kind][str(number)] = row
            print(kind, number, row, flush=True)
            write(record, options.out)
    if options.out == RECORD:
        write_page(record)
    for kind in REFUSED:
        if options.outlines and kind not in record["refused"]:
            record["refused"][kind] = refusal(kind)
            print(kind, record["refused"][kind], flush=True)
            write(record, options.out)
    for line in summary(record):
        print(line)


def write(record: dict[str, Any], path: Path) -> None:
    """Write the record with one line for each film."""
    parts = {}
    for kind in ("markers", "outline", "refused"):
        rows = sorted(record[kind].items(), key=lambda item: (len(item[0]), item[0]))
        lines = [f"  {json.dumps(key)}: {json.dumps(row)}" for key, row in rows]
        parts[kind] = "{\n" + ",\n".join(lines) + "\n }" if lines else "{}"
    body = ",\n".join(f' "{kind}": {text}' for kind, text in parts.items())
    head = f' "provenance": {json.dumps(provenance())},\n'
    path.parent.mkdir(exist_ok=True)
    path.write_text("{\n" + head + body + "\n}\n", encoding="utf-8")


def statistics(rows: list[dict[str, Any]], within: float) -> dict[str, Any]:
    """Return accuracy and coverage of the efficiency over films."""
    good = [row for row in rows if "error" not in row]
    values = np.array([row["efficiency"] for row in good], dtype=np.float64)
    true, found, low, high = values.reshape(-1, 4).T
    deviation = np.abs(found / true - 1.0)
    return {
        "films": len(rows),
        "measured": len(good),
        "within": float(np.sum(deviation <= within) / len(rows)),
        "covered": float(np.mean((low <= true) & (true <= high))) if good else 0.0,
        "median_deviation": float(np.median(deviation)) if good else np.nan,
        "median_half_width": (
            float(np.median(0.5 * (high - low) / np.abs(found))) if good else np.nan
        ),
    }


def table(record: dict[str, Any]) -> Iterator[str]:
    """Yield the rows of the table of `docs/measure.md`."""
    for kind, within in (("markers", 0.02), ("outline", 0.05)):
        rows = list(record[kind].values())
        designs = sorted({row["design"] for row in rows})
        for name in ("", *designs) if rows else ():
            own = [row for row in rows if not name or row["design"] == name]
            found = statistics(own, within)
            yield (
                f"| {kind} | {f'`{name}`' if name else 'all'} | {found['films']} | "
                f"{found['within']:.1%} | {found['covered']:.1%} | "
                f"{found['median_deviation']:.2%} | {found['median_half_width']:.2%} |"
            ).replace("%", " %")


def write_page(record: dict[str, Any]) -> None:
    """Replace the table in `docs/measure.md` by that of the record."""
    text = PAGE.read_text(encoding="utf-8")
    before, after = text.split(HEAD)[0], text.split(HEAD)[1]
    rest = after.split("\n\n", 1)[1]
    rows = "\n".join(table(record))
    PAGE.write_text(f"{before}{HEAD}\n{RULE}\n{rows}\n\n{rest}", encoding="utf-8")


def summary(record: dict[str, Any]) -> Iterator[str]:
    """Yield lines about the record."""
    for kind, within in (("markers", 0.02), ("outline", 0.05)):
        rows = list(record[kind].values())
        if rows:
            yield f"{kind}: {statistics(rows, within)}"
            for name in sorted({row["design"] for row in rows}):
                own = [row for row in rows if row["design"] == name]
                if any("error" not in row for row in own):
                    yield f"  {name}: {statistics(own, within)}"


if __name__ == "__main__":
    main()
