"""Benchmarks in space; importing them adds them to the registry."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from reproduction.frame_benchmarks.definition import (
    Benchmark,
    Published,
    Values,
    benchmarks,
    buckling_load,
    converged,
    line,
)
from reproduction.frame_benchmarks.exact import bend_tip, lateral_buckling
from reproduction.frame_benchmarks.frames import BenchmarkFrame, Response, Rigidity
from reproduction.frame_benchmarks.plane import ROLL_UP, roll_up

benchmarks.register("roll-up-space")(
    Benchmark(
        title="The same cantilever in space",
        dimension=3,
        data="As in the plane; the other EI is 10 times as large, GJ = 5 EI.",
        compute=lambda count, bowed: roll_up(count, bowed, 3),
        **ROLL_UP,  # type: ignore[arg-type]
    )
)

BEND_RADIUS, BEND_ANGLE, FORCE = 100.0, 0.25 * math.pi, 600.0
BEND_TORSION = {"bend": 1.0 / 6.0, "bend-square": 0.1406}
"""Torsion constant J of the 45-degree bend: the sum of both second moments of area, as in most
programs, and that of a square."""


def bend_rigidity(torsion: float) -> Rigidity:
    """Return the stiffness of the section 1 x 1 with E = 1e7 and G = 5e6."""
    return Rigidity(1e7, 1e7 / 12.0, 1e7 / 12.0, 5e6 * torsion, 5e6)


def bend(count: int, bowed: bool, torsion: float) -> Values:
    """Return the displacements of the tip of the 45-degree bend."""
    angle = np.linspace(0.0, BEND_ANGLE, count + 1)
    nodes = BEND_RADIUS * np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1)
    frame = BenchmarkFrame(
        nodes, bend_rigidity(torsion), {0: "xyzr"}, load={count: (0.0, 0.0, FORCE, 0.0, 0.0, 0.0)},
        bowed=bowed,
    )  # fmt: skip
    return [abs(float(each)) for each in converged(frame)[-1]]


def _exact_bend(torsion: float) -> Values:
    forces = (150.0, 300.0, 450.0, FORCE)
    tip = bend_tip(bend_rigidity(torsion), BEND_RADIUS, BEND_ANGLE, forces)
    found: Values = np.abs(tip).tolist()
    return found


for _name, _torsion, _published in (
    (
        "bend", BEND_TORSION["bend"],
        (
            Published(
                values=(23.5, 13.4, 53.4), digits=1, elements=8,
                source="Bathe and Bolourchi 1979, 8 straight beams",
            ),
            Published(
                values=(23.48, 13.50, 53.37), digits=2, elements=8,
                source="Simo and Vu-Quoc 1986, 8 linear elements",
            ),
        ),
    ),
    ("bend-square", BEND_TORSION["bend-square"], ()),
):  # fmt: skip
    benchmarks.register(_name)(
        Benchmark(
            title=f"45-degree bend, J = {_torsion:.4g}",
            dimension=3,
            source="K.-J. Bathe and S. Bolourchi, Int. J. Numer. Methods Eng. 14, 961 (1979), "
            "[doi:10.1002/nme.1620140703](https://doi.org/10.1002/nme.1620140703)",
            data="Arc of 45 degrees, radius 100 in, section 1 in x 1 in, E = 1e7 psi, G = 5e6 psi, "
            "clamped; force of 600 lb at the tip normal to the plane.",
            quantities=("u, in", "v, in", "w, in"),
            compute=partial(bend, torsion=_torsion),
            exact=partial(_exact_bend, _torsion),
            method="shooting, extensible, with shear",
            published=_published,
            full=(8, 16, 32, 64),
            quick=(8, 16),
        )
    )

ARM, YOUNG = 240.0, 71240.0
ANGLE = Rigidity(
    YOUNG * 18.0, YOUNG * 1350.0, YOUNG * 0.54, YOUNG / 2.62 * 30.0 * 0.6**3 / 3.0
)  # fmt: skip


def right_angle(count: int, force: float, bowed: bool) -> BenchmarkFrame:
    """Return the right-angle frame with `count` elements in each arm."""
    corner, end = np.array([ARM, 0.0, 0.0]), np.array([ARM, -ARM, 0.0])
    nodes = np.concatenate([line(np.zeros(3), corner, count), line(corner, end, count)[1:]])
    return BenchmarkFrame(
        nodes, ANGLE, {0: "xyzr"}, load={2 * count: (force, 0.0, 0.0, 0.0, 0.0, 0.0)},
        bowed=bowed,
    )  # fmt: skip


benchmarks.register("right-angle-frame")(
    Benchmark(
        title="Right-angle frame: buckling out of its plane",
        dimension=3,
        source="J. H. Argyris et al., Comput. Methods Appl. Mech. Eng. 17/18, 1 (1979); J. C. Simo "
        "and L. Vu-Quoc, the same journal 58, 79 (1986), with the load of K. Nachbagauer and "
        "J. Gerstmayr, J. Comput. Nonlinear Dyn. 9, 011013 (2014); "
        "[doi:10.1016/0045-7825(86)90079-4](https://doi.org/10.1016/0045-7825(86)90079-4)",
        data="Two arms of 240 mm, section 30 mm x 0.6 mm, E = 71240 MPa, Poisson's ratio 0.31, "
        "J = 2.16 mm⁴; clamped; force at the free end along the first arm. Elements in each arm.",
        quantities=("critical force, N",),
        compute=lambda count, bowed: [
            buckling_load(lambda p: right_angle(count, p, bowed), 0.9, 1.3)
        ],
        published=(
            Published(
                values=(1.088,),
                digits=3,
                source="Simo and Vu-Quoc 1986, as quoted by Nachbagauer and Gerstmayr 2014",
            ),
        ),
        full=(4, 8, 16, 32),
        quick=(4, 8),
    )
)

DEEP = Rigidity(1e8, 1e6, 1.0, 0.7)


def deep_cantilever(count: int, factor: float, bowed: bool) -> BenchmarkFrame:
    """Return a deep cantilever of length 1 under an end load, in units of sqrt(EI GJ) / L^2."""
    nodes = line(np.zeros(3), np.array([1.0, 0.0, 0.0]), count)
    force = factor * math.sqrt(DEEP.bending_out * DEEP.torsion)
    return BenchmarkFrame(
        nodes, DEEP, {0: "xyzr"}, load={count: (0.0, force, 0.0, 0.0, 0.0, 0.0)}, bowed=bowed,
    )  # fmt: skip


benchmarks.register("deep-cantilever")(
    Benchmark(
        title="Deep cantilever: lateral buckling",
        dimension=3,
        source="S. P. Timoshenko and J. M. Gere, Theory of Elastic Stability, 2nd edition (1961), "
        "section 6.4",
        data="Length L, clamped; GJ = 0.7 EI out of the plane, EI in the plane 10⁶ times as large; "
        "force across the end in the plane.",
        quantities=("P L² / √(EI GJ)",),
        compute=lambda count, bowed: [
            buckling_load(lambda p: deep_cantilever(count, p, bowed), 3.5, 4.8)
        ],
        exact=lambda: [lateral_buckling()],
        method="zero of a Bessel function",
        published=(
            Published(values=(4.013,), digits=3, source="Timoshenko and Gere 1961"),
        ),
        full=(8, 16, 32, 64),
        quick=(8, 16),
    )
)  # fmt: skip

RING_RADIUS, RING_YOUNG = 20.0, 2.1e7
RING = Rigidity(
    RING_YOUNG / 3.0, RING_YOUNG / 324.0, RING_YOUNG / 36.0, RING_YOUNG / 2.6 * 9.753e-3
)


def ring(count: int, turn: float, bowed: bool = False) -> Response:
    """Return the response of the deployable ring to a turn of a point about a diameter.

    Parameters
    ----------
    count
        Number of elements, even.
    turn
        Rotation of the point opposite to the clamp, rad.
    bowed
        Whether beams become shorter when they bend.
    """
    angle = math.pi + 2.0 * math.pi * np.arange(count) / count
    nodes = RING_RADIUS * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    turned = count // 2
    frame = BenchmarkFrame(
        nodes, RING, {0: "xyzr", turned: "yzr"},
        drive={turned: (0.0, 0.0, 0.0, turn, 0.0, 0.0)}, closed=True, bowed=bowed,
    )  # fmt: skip
    return frame.respond()


def folded_ring(count: int, bowed: bool) -> Values:
    """Return the displacement of the turned point after a full turn, over the radius.

    Raises
    ------
    ArithmeticError
        If the path of stable equilibria does not lead there.
    """
    response = ring(count, 2.0 * math.pi, bowed)
    if response.reached < 1.0:
        raise ArithmeticError(f"the path of the ring ends at {response.reached:.4f} of the turn")
    return [-float(response.displacement[count // 2, 0]) / RING_RADIUS]


benchmarks.register("ring")(
    Benchmark(
        title="Deployable ring: folded by a full turn",
        dimension=3,
        source="Y. Goto, Y. Watanabe, T. Kasugai and M. Obata, Int. J. Solids Struct. 29, 893 "
        "(1992), [doi:10.1016/0020-7683(92)90024-N](https://doi.org/10.1016/0020-7683(92)90024-N)",
        data="Radius 20, section 1/3 in the plane of the ring and 1 normal to it, E = 2.1e7, "
        "Poisson's ratio 0.3, J = 9.753e-3; clamped at one point; the opposite point is turned by "
        "360 degrees about the diameter and moves along it.",
        quantities=("displacement / R",),
        compute=folded_ring,
        exact=lambda: [4.0 / 3.0],
        method="three turns of a third of the radius",
        full=(24, 48, 96, 192),
        quick=(24, 48),
    )
)
