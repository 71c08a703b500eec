"""Machines of two parts foretold along the stroke: ``python -m benchmarks.strokes``.

Those that the tests know too (``tests/machines/actuators.py``), at the stroke that their parts were
made for and beyond it: the largest difference of output motion and input force from the simulation
of the whole lattice, by tables and by the parts themselves. Writes ``docs/machines/strokes.json``.
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

from bellcrank.machines import compare, foretell, predict, simulate
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from tests.machines.actuators import KINDS, machine

RECORD = Path(__file__).parents[1] / "docs" / "machines" / "strokes.json"
POINTS = 20

LONGER = {"row": (4, 6), "turned": (2, 6)}


def measure(kind: str, times: int, folder: Path) -> dict[str, object]:
    """Foretell a machine pushed so many times as far as its parts were made for."""
    built = machine(kind)
    if times > 1:
        made_for = built.design.problem.input.amount
        built = machine(kind, drive={"amount": times * made_for})
    whole = simulate(built, POINTS)
    tables = foretell(built, POINTS, folder=folder)
    checked = compare(tables, whole)
    live = compare(foretell(built, POINTS, folder=folder, live=True), whole)
    small = predict(built).efficiency
    return {
        "machine": kind,
        "times": times,
        "small_strokes": small,
        "full_stroke": float(whole.efficiency[-1]),
        "linear_off": abs(small / float(whole.efficiency[-1]) - 1.0),
        "motion": checked.output_error,
        "force": checked.force_error,
        "live_motion": live.output_error,
        "followed_themselves": sum(stand.kind == "itself" for stand in tables.stands),
    }


def main() -> None:
    rows = []
    with TemporaryDirectory() as folder:
        for kind in KINDS:
            for times in (1, *LONGER.get(kind, ())):
                rows.append(measure(kind, times, Path(folder)))
                print(rows[-1], flush=True)
    record = {"points": POINTS, "rows": rows, "provenance": provenance()}
    write_text(RECORD, json.dumps(record, indent=1) + "\n", overwrite=True)


if __name__ == "__main__":
    main()
