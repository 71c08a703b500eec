"""Cost of validation: ``python -m benchmarks.validation [--quick]``.

Measure the time of each level of analysis of the crane over the full stroke, and the time of a
linear frame analysis as a function of the number of struts. Markdown tables are printed.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np

from bellcrank.fem import FemSettings, levels
from bellcrank.fem.frame.equations import FrameEquations, part_frame
from bellcrank.model.builtin.scaling import scaling
from bellcrank.part import PartSpec
from bellcrank.workflows import find_design

SIZES = (8, 12, 16, 20, 28, 40)
REPEATS = 3


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="only frame analyses of the crane")
    quick = parser.parse_args().quick
    crane_table(quick=quick)
    size_table()


def crane_table(*, quick: bool) -> None:
    """Print time and memory of each level of analysis of the crane."""
    analyses = [
        ("frame", FemSettings(linear=True)),
        ("frame", FemSettings()),
        ("plane", FemSettings(linear=True)),
        ("plane", FemSettings()),
        ("solid", FemSettings(linear=True)),
    ]
    print("| design | level | unknowns | factorisations | seconds | peak memory of the process |")
    print("|---|---|---|---|---|---|")
    for design in ("crane", "human:crane", "machine:crane"):
        part = PartSpec().of(find_design(design))
        for level, settings in analyses[: 2 if quick else None]:
            start = time.perf_counter()
            analysis = levels[level](part, settings)
            elapsed = time.perf_counter() - start
            name = f"{level}, {analysis.theory}" + (", linear" if settings.linear else "")
            cost = analysis.cost
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
            print(
                f"| {design} | {name} | {cost['unknowns']:.0f} | {cost['factorisations']:.0f} "
                f"| {elapsed:.2f} | {memory:.1f} GB |",
                flush=True,
            )


def size_table() -> None:
    """Print the time of a linear frame analysis for several numbers of struts."""
    struts, seconds = [], []
    print("\n| struts | unknowns | seconds | us per strut |")
    print("|---|---|---|---|")
    for size in SIZES:
        part = PartSpec().of(scaling(size).full_design())
        times = []
        for _ in range(REPEATS):
            start = time.perf_counter()
            equations = FrameEquations(part_frame(part))
            equations.solve_linear()
            times.append(time.perf_counter() - start)
        struts.append(part.design.beam_count)
        seconds.append(min(times))
        print(
            f"| {struts[-1]} | {equations.count} | {seconds[-1]:.3f} "
            f"| {1e6 * seconds[-1] / struts[-1]:.0f} |"
        )
    exponent = np.polyfit(np.log(struts), np.log(seconds), 1)[0]
    print(f"\nThe time is proportional to the number of struts to the power {exponent:.2f}.")


if __name__ == "__main__":
    main()
