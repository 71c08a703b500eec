"""Keep what a benchmark prints: ``python -m benchmarks.keep report --quick``.

Runs ``python -m benchmarks.NAME`` with what follows the name, shows what it prints, and writes that
with its provenance to ``docs/benchmarks/NAME.json``, so that the documentation can quote it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance

FOLDER = Path(__file__).parents[1] / "docs" / "benchmarks"


def main() -> None:
    name, *options = sys.argv[1:]
    before = os.getloadavg()[0]
    command = ["python", "-m", f"benchmarks.{name}", *options]
    lines = []
    with subprocess.Popen([sys.executable, *command[1:]], stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        for line in run.stdout:
            print(line, end="", flush=True)
            lines.append(line.rstrip())
    if run.returncode:
        sys.exit(run.returncode)
    record = {
        "command": " ".join(command),
        "processors": os.cpu_count(),
        "load_before": round(before, 1),
        "printed": lines,
        "provenance": provenance(),
    }
    FOLDER.mkdir(parents=True, exist_ok=True)
    write_text(FOLDER / f"{name}.json", json.dumps(record, indent=1) + "\n", overwrite=True)


if __name__ == "__main__":
    main()
