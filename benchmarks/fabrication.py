"""Time and size of exported files, G-code and a movie.

``python -m benchmarks.fabrication [--quick]`` prints a Markdown table of all export formats.
"""

from __future__ import annotations

import argparse
import shutil
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from bellcrank.export import Export, exporters
from bellcrank.export.profiles import profiles
from bellcrank.model import find_problem
from bellcrank.model.builtin.scaling import scaling
from bellcrank.part import PartSpec
from bellcrank.plots.movies import movie_settings
from bellcrank.workflows import find_design
from bellcrank.workflows.animate import MotionOptions, animate_motion
from bellcrank.workflows.fabricate import print_design

SLOW = ("step",)
"""Formats whose export takes minutes for thousands of struts."""


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="only the export of the crane")
    quick = parser.parse_args().quick
    designs = {"crane": find_problem("crane").full_design()}
    if not quick:
        designs["scaling, 40 rows"] = scaling(40).full_design()
    print("| part | struts | format | seconds | MB |\n|---|---|---|---|---|")
    for name, design in designs.items():
        part = PartSpec().of(design)
        exporters["stl"].to_bytes(Export(part=part))  # loads the modules
        for kind, exporter in exporters.items():
            if kind in SLOW and name != "crane":
                continue
            start = time.perf_counter()
            content = exporter.to_bytes(Export(part=part))
            elapsed = time.perf_counter() - start
            print(
                f"| {name} | {design.beam_count} | {kind} | {elapsed:.2f} "
                f"| {len(content) / 1e6:.2f} |",
                flush=True,
            )
    if quick:
        return
    with TemporaryDirectory() as folder:
        start = time.perf_counter()
        path = Path(folder) / "crane.mp4"
        settings = movie_settings(path, 5.0, None, None)
        animate_motion(
            [("crane", find_design("machine:crane"))],
            path,
            settings,
            MotionOptions(),
            overwrite=False,
        )
        print(f"\nMovie of 5 s, 1080p: {time.perf_counter() - start:.1f} s")
        if shutil.which("prusa-slicer"):
            start = time.perf_counter()
            bundle = Export(part=PartSpec().of(designs["crane"]))
            job = print_design(bundle, profiles["ninjaflex"], Path(folder) / "crane.gcode")
            fraction = job.sliced.deposit.volume / job.volume
            print(
                f"G-code of the crane: {time.perf_counter() - start:.1f} s, "
                f"{job.sliced.deposit.layers} layers, deposited volume {fraction:.1%} of the solid"
            )


if __name__ == "__main__":
    main()
