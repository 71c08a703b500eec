"""Measurements from rendered films against what was rendered: ``python -m benchmarks.measure``.

Films of bundled designs that deform as computed by frames are rendered
(`benchmarks.random_films`), written as H.264, and measured like films of printed parts: with
markers, and without markers by the outline. Tilt, light, focus, noise, lens, size and number of
pictures, placement of the markers and the scale of the printed sheet are random. Films that cannot
be measured must be refused. The record is ``docs/benchmarks/measure.json``; films that are in it
are not made again.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from bellcrank.errors import UnreadableFilm
from bellcrank.measure import MeasureSettings, open_film
from bellcrank.provenance import provenance
from bellcrank.workflows.measure import (
    measure_film,
    measure_outline,
    result_data,
)
from benchmarks.random_films import (
    DESIGNS,
    PLACEMENT,
    REFUSED,
    SHEET,
    computed,
    marker_film,
    outline_film,
    refused_film,
)

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
FILMS, OUTLINES = 200, 42


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


def measured_outline(number: int) -> dict[str, Any]:
    """Render and measure one film without markers."""
    with TemporaryDirectory() as folder:
        about, path = outline_film(number, Path(folder))
        start = time.perf_counter()
        data = result_data(measure_outline(open_film([path]), computed(about["design"])))
    seconds = time.perf_counter() - start
    return {**about, **figures(data), "seconds": round(seconds, 2)}


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
