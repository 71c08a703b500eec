"""Measure the bundled entries of the library again: ``python -m benchmarks.library``.

Each entry is read, measured as frames of the default part (struts of 2 mm on 10 mm), and written
under its name, which contains the hash of its problem. Plans of bundled machines follow renamed
entries, and the page of the library in ``docs/library`` is written anew.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from bellcrank.machines.library import Library, bundled_folder, read_entry, write_entry
from bellcrank.machines.library.catalogue import entry_files
from bellcrank.machines.library.pages import write_page
from bellcrank.workflows.library_measurement import measure_again

ROOT = Path(__file__).parents[1]
PLANS = ROOT / "src" / "bellcrank" / "machines" / "bundled"
PAGE = ROOT / "docs" / "library"


def renew(path: Path) -> tuple[str, str, str]:
    """Measure and write one entry; return its old name, its new name and its figures."""
    old = read_entry(path)
    new = measure_again(old)
    write_entry(new, path.parent, overwrite=True)
    if new.name != old.name:
        path.unlink()
    return old.name, new.name, f"{old.efficiency:.3f} -> {new.efficiency:.3f}"


def main() -> None:
    """Measure all entries, rename them in the plans, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers", type=int, default=2, help="number of processes")
    options = parser.parse_args()
    folder = bundled_folder()
    with ProcessPoolExecutor(options.workers) as pool:
        for old, new, figures in pool.map(renew, entry_files(folder)):
            print(f"{old} {new} {figures}", flush=True)
            for plan in PLANS.glob("*.toml"):
                text = plan.read_text(encoding="utf-8")
                plan.write_text(text.replace(old, new), encoding="utf-8")
    write_page(Library((folder,)), PAGE, overwrite=True)


if __name__ == "__main__":
    main()
