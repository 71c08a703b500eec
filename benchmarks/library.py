"""Measure the bundled entries of the library again: ``python -m benchmarks.library``.

Each entry is read, measured as frames of the default part (struts of 2 mm on 10 mm), and written
under its name, which contains the hash of its problem, with the items of its specification by
frames of 8 elements and in the sheet. Plans of bundled machines follow
renamed entries, and the page of the library in ``docs/library`` is written anew.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.fem.continuum.mesh import COARSE
from bellcrank.fem.specification import sheet_items
from bellcrank.machines.library import Library, bundled_folder, read_entry, write_entry
from bellcrank.machines.library.catalogue import entry_files
from bellcrank.machines.library.pages import write_page
from bellcrank.machines.library.tasks import EntryTask
from bellcrank.part import PartSpec
from bellcrank.refine.state import state_of
from bellcrank.workflows.library_measurement import measure_again
from bellcrank.workflows.specification import item_data

if TYPE_CHECKING:
    from bellcrank.machines.library import Entry

ROOT = Path(__file__).parents[1]
PLANS = ROOT / "src" / "bellcrank" / "machines" / "bundled"
PAGE = ROOT / "docs" / "library"


def with_items(entry: Entry) -> Entry:
    """Return an entry with the items of its kind by frames and in the sheet."""
    assert entry.columns is not None, "bundled entries are made by tasks"
    wanted = EntryTask(entry.direction, entry.columns, entry.kind).problem().specification
    design = replace(
        entry.design, problem=replace(entry.design.problem, specification=wanted), efficiency=None
    )
    state = state_of(design.problem, design.mask)
    sheet = sheet_items(PartSpec().of(design), fineness=COARSE)
    models = {"frames, 8 elements": state.items, **({"sheet": sheet} if sheet else {})}
    items = item_data(design.problem, PartSpec(), models)
    return replace(entry, provenance={**entry.provenance, "items": items})


def renew(path: Path) -> tuple[str, str, str]:
    """Measure and write one entry; return its old name, its new name and its figures."""
    old = read_entry(path)
    new = with_items(measure_again(old))
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
