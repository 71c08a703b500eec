"""Benchmarks in the plane."""

from __future__ import annotations

import math

import numpy as np

from reproduction.frame_benchmarks.definition import (
    Benchmark,
    Published,
    Values,
    benchmarks,
    converged,
    limit_load,
    line,
    pushing_force,
)
from reproduction.frame_benchmarks.exact import PlaneRod, elastica
from reproduction.frame_benchmarks.frames import BenchmarkFrame, Rigidity

LOADS = (1.0, 2.0, 5.0, 10.0)
"""Loads of the cantilever, P L^2 / E I."""
SLENDER = 1.2e7
"""EA L^2 / EI of the cantilevers: a strut with a width of a thousandth of its length."""
MATTIASSON = ((0.30172, 0.05643), (0.49346, 0.16064), (0.71379, 0.38763), (0.81061, 0.55500))
"""Deflection and shortening of the cantilever over its length at these loads."""


def cantilever(count: int, bowed: bool) -> Values:
    """Return the displacements of the tip of a cantilever under the loads."""
    found = []
    for load in LOADS:
        frame = BenchmarkFrame(
            line(np.zeros(2), np.array([1.0, 0.0]), count), Rigidity(SLENDER, 1.0), {0: "xyr"},
            load={count: (0.0, load, 0.0)}, bowed=bowed,
        )  # fmt: skip
        along, across = converged(frame)[-1]
        found += [float(across), float(-along)]
    return found


def _exact_cantilever() -> Values:
    return [value for load in LOADS for value in elastica(load)[1::-1]]


benchmarks.register("cantilever")(
    Benchmark(
        title="Cantilever under a force across its end",
        dimension=2,
        source="K. Mattiasson, Int. J. Numer. Methods Eng. 17, 145 (1981), "
        "[doi:10.1002/nme.1620170113](https://doi.org/10.1002/nme.1620170113), table 1",
        data="Length L, EA L² / EI = 1.2e7; dead force P across the end, P L² / EI = 1, 2, 5 "
        "and 10.",
        quantities=tuple(
            f"{what} / L at {load:g}" for load in LOADS for what in ("deflection", "shortening")
        ),
        compute=cantilever,
        exact=_exact_cantilever,
        method="elliptic integrals, inextensible",
        published=(
            Published(
                values=tuple(value for pair in MATTIASSON for value in pair), digits=5,
                source="Mattiasson 1981, elliptic integrals",
            ),
        ),
        full=(8, 16, 32, 64),
        quick=(8, 16, 32),
    )
)  # fmt: skip


def roll_up(count: int, bowed: bool, dimension: int = 2) -> Values:
    """Return the tip displacement of a cantilever that a moment bends to half a circle."""
    end = np.zeros(dimension)
    end[0] = 1.0
    moment = np.zeros(3 * (dimension - 1))
    moment[-1] = math.pi
    # In space it bends about its weak axis and so does not buckle.
    frame = BenchmarkFrame(
        line(np.zeros(dimension), end, count), Rigidity(SLENDER, 1.0, 10.0, 5.0),
        {0: "xyzr"[:dimension] + "r"}, load={count: moment}, bowed=bowed,
    )  # fmt: skip
    x, y = converged(frame)[-1, :2]
    return [float(x), float(y)]


ROLL_UP = {
    "source": "closed form, the curvature of a beam under a moment is uniform",
    "quantities": ("u / L", "v / L"),
    "exact": lambda: [-1.0, 2.0 / math.pi],
    "method": "half a circle",
    "full": (8, 16, 32, 64),
    "quick": (8, 16, 32),
}
benchmarks.register("roll-up")(
    Benchmark(
        title="Cantilever bent to half a circle by a moment at its end",
        dimension=2,
        data="Length L, EA L² / EI = 1.2e7; moment π EI / L.",
        compute=roll_up,
        **ROLL_UP,  # type: ignore[arg-type]
    )
)

LEE_LENGTH, LEE = 120.0, Rigidity(6.0 * 720.0, 2.0 * 720.0)


def lee_frame(count: int, deflection: float, bowed: bool = False) -> BenchmarkFrame:
    """Return Lee's frame with `count` elements in each bar, pushed down by a deflection."""
    corner = np.array([0.0, LEE_LENGTH])
    column = line(np.zeros(2), corner, count)
    bar = line(corner, np.array([LEE_LENGTH, LEE_LENGTH]), count)
    loaded = count + count // 5
    return BenchmarkFrame(
        np.concatenate([column, bar[1:]]), LEE, {0: "xy", 2 * count: "xy", loaded: "y"},
        drive={loaded: (0.0, -deflection, 0.0)}, bowed=bowed,
    )  # fmt: skip


def _exact_lee() -> Values:
    length, turn = LEE_LENGTH, 0.5 * math.pi
    pieces = ((length, 0.0, turn), (0.2 * length, 0.0, -turn), (0.8 * length, 0.0, 0.0))
    return [PlaneRod(LEE.axial, LEE.bending, pieces, 2, clamped=False).limit_load(60.0, 12)]


benchmarks.register("lee-frame")(
    Benchmark(
        title="Lee's frame: limit load",
        dimension=2,
        source="S.-L. Lee, F. S. Manuel and E. C. Rossow, J. Eng. Mech. Div. ASCE 94 (EM2), 521 "
        "(1968)",
        data="Column and bar, each 120 long, hinged at their far ends; EA = 4320, EI = 1440; force "
        "down on the bar at a fifth of its length from the corner. Elements in each member.",
        quantities=("limit load",),
        compute=lambda count, bowed: [
            limit_load(lambda v: lee_frame(count, v, bowed), 35.0, 58.0)
        ],
        exact=_exact_lee,
        method="shooting, extensible",
        published=(
            Published(
                values=(1.8532,), digits=4, elements=5,
                source="Simo and Vu-Quoc 1986, 5 quadratic elements in each member, with shear",
            ),
        ),
        full=(5, 10, 20, 40, 80),
        quick=(5, 10, 20),
    )
)  # fmt: skip

HALF_SPAN, RISE = 12.943, 0.386
TOGGLE = Rigidity(1.885e6, 9.27e3)


def toggle_frame(count: int, deflection: float, bowed: bool = False) -> BenchmarkFrame:
    """Return Williams' toggle with `count` elements in each bar, pushed down by a deflection."""
    top, end = np.array([HALF_SPAN, RISE]), np.array([2.0 * HALF_SPAN, 0.0])
    nodes = np.concatenate([line(np.zeros(2), top, count), line(top, end, count)[1:]])
    return BenchmarkFrame(
        nodes, TOGGLE, {0: "xyr", 2 * count: "xyr", count: "y"},
        drive={count: (0.0, -deflection, 0.0)}, bowed=bowed,
    )  # fmt: skip


def _exact_toggle() -> Values:
    piece = (math.hypot(HALF_SPAN, RISE), 0.0, math.atan2(RISE, HALF_SPAN))
    rod = PlaneRod(TOGGLE.axial, TOGGLE.bending, (piece,), 1, clamped=True, guided=True)
    return [rod.limit_load(0.4, 8), rod.loads([0.2, 0.4, 0.6])[-1]]


benchmarks.register("toggle")(
    Benchmark(
        title="Williams' toggle: limit load and force after the snap",
        dimension=2,
        source="F. W. Williams, Q. J. Mech. Appl. Math. 17, 451 (1964), "
        "[doi:10.1093/qjmam/17.4.451](https://doi.org/10.1093/qjmam/17.4.451)",
        data="Two bars, clamped at their far ends, half span 12.943 in, rise 0.386 in; "
        "EA = 1.885e6 lb, EI = 9.27e3 lb in²; force down on their joint. Elements in each bar.",
        quantities=("limit load, lb", "force at a deflection of 0.6 in, lb"),
        compute=lambda count, bowed: [
            limit_load(lambda v: toggle_frame(count, v, bowed), 0.1, 0.4),
            pushing_force(toggle_frame(count, 0.6, bowed)),
        ],
        exact=_exact_toggle,
        method="shooting, extensible",
        full=(8, 16, 32, 64),
        quick=(8, 16, 32),
    )
)  # fmt: skip

RADIUS, OPENING = 100.0, math.radians(215.0)
ARCH = Rigidity(1e8, 1e6)


def arch_frame(count: int, deflection: float, bowed: bool = False) -> BenchmarkFrame:
    """Return the clamped and hinged arch with `count` elements, pushed down by a deflection."""
    angle = 0.5 * (math.pi + OPENING) - np.linspace(0.0, OPENING, count + 1)
    nodes = RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    top = count // 2
    return BenchmarkFrame(
        nodes, ARCH, {0: "xyr", count: "xy", top: "y"}, drive={top: (0.0, -deflection, 0.0)},
        bowed=bowed,
    )  # fmt: skip


def _exact_arch() -> Values:
    half = 0.5 * RADIUS * OPENING
    pieces = ((half, -1.0 / RADIUS, 0.5 * OPENING), (half, -1.0 / RADIUS, 0.0))
    return [PlaneRod(ARCH.axial, ARCH.bending, pieces, 1, clamped=True).limit_load(118.0, 12)]


benchmarks.register("arch")(
    Benchmark(
        title="Deep arch, clamped and hinged: limit load",
        dimension=2,
        source="D. A. DaDeppo and R. Schmidt, J. Appl. Mech. 42, 894 (1975), "
        "[doi:10.1115/1.3423734](https://doi.org/10.1115/1.3423734)",
        data="Arc of 215 degrees, radius 100, clamped at one end and hinged at the other; EA = "
        "1e8, EI = 1e6; force down on its top.",
        quantities=("limit load",),
        compute=lambda count, bowed: [
            limit_load(lambda v: arch_frame(count, v, bowed), 108.0, 117.5)
        ],
        exact=_exact_arch,
        method="shooting, extensible",
        published=(
            Published(
                values=(897.0,), digits=0,
                source="DaDeppo and Schmidt 1975, Euler's theory, inextensible",
            ),
            Published(
                values=(905.28,), digits=2, elements=40,
                source="Simo and Vu-Quoc 1986, 40 linear elements",
            ),
        ),
        full=(20, 40, 80, 160),
        quick=(20, 40, 80),
    )
)  # fmt: skip
