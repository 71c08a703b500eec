"""What validation costs: ``python -m benchmarks.validation [--quick]``.

Times of the crane's levels over the whole stroke, and how the cost of linear frames grows with
the number of struts. Printed as Markdown tables.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np

from bellcrank.fem import FemSettings, levels
from bellcrank.fem.frame.equilibrium import solve_linear
from bellcrank.fem.frame.mesh import frame_mesh
from bellcrank.fem.frame.system import frame_system
from bellcrank.model.builtin.scaling import scaling
from bellcrank.part import PartSpec
from bellcrank.workflows import find_design

SIZES = (8, 12, 16, 20, 28, 40)
REPEATS = 3


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="frames only")
    quick = parser.parse_args().quick
    crane_table(quick=quick)
    growth_table()


def crane_table(*, quick: bool) -> None:
    """Print what each level of the crane costs."""
    jobs = [
        ("frame", FemSettings(linear=True)),
        ("frame", FemSettings()),
        ("plane", FemSettings(linear=True)),
        ("plane", FemSettings()),
        ("solid", FemSettings(linear=True)),
    ]
    print("| design | level | unknowns | factorisations | seconds | memory so far |")
    print("|---|---|---|---|---|---|")
    for what in ("crane", "human:crane", "machine:crane"):
        part = PartSpec().of(find_design(what))
        for level, settings in jobs[: 2 if quick else None]:
            began = time.perf_counter()
            analysis = levels[level](part, settings)
            spent = time.perf_counter() - began
            name = f"{level}, {analysis.theory}" + (", linear" if settings.linear else "")
            cost = analysis.cost
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
            print(
                f"| {what} | {name} | {cost['unknowns']:.0f} | {cost['factorisations']:.0f} "
                f"| {spent:.2f} | {memory:.1f} GB |",
                flush=True,
            )


def growth_table() -> None:
    """Print how linear frames grow with the number of struts."""
    struts, seconds = [], []
    print("\n| struts | unknowns | seconds | us per strut |")
    print("|---|---|---|---|")
    for size in SIZES:
        part = PartSpec().of(scaling(size).full_design())
        times = []
        for _ in range(REPEATS):
            began = time.perf_counter()
            system = frame_system(part, frame_mesh(part))
            solve_linear(system)
            times.append(time.perf_counter() - began)
        struts.append(part.design.beam_count)
        seconds.append(min(times))
        print(
            f"| {struts[-1]} | {len(system.free)} | {seconds[-1]:.3f} "
            f"| {1e6 * seconds[-1] / struts[-1]:.0f} |"
        )
    exponent = np.polyfit(np.log(struts), np.log(seconds), 1)[0]
    print(f"\nCost grows with the number of struts to the power {exponent:.2f}.")


if __name__ == "__main__":
    main()
