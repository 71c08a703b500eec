"""Frames against published and exact solutions of large rotations and of losses of stability."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar, root

from bellcrank.model import Input, Output, Supports
from tests.physics.frames import Array, Equilibrium, chain, equilibrium, frame_of
from tests.physics.test_frame_beams import stiffness

if TYPE_CHECKING:
    from collections.abc import Callable

BEND = np.array([23.56024, 13.60452, 53.47486])
"""Tip of the 45-degree bend (K.-J. Bathe and S. Bolourchi, Int. J. Numer. Methods Eng. 14, 961,
1979; radius 100, section 1 x 1, E = 1e7, G = 5e6, J = 1/6, load 600), in the limit of many elements
by a shooting solution of the rod equations (`../shared/reference3d`)."""


def bend(count: int) -> Array:
    """Return the tip displacement of the 45-degree bend; the unit is the length of an element."""
    angle = np.linspace(0.0, np.pi / 4, count + 1)
    unit = 100.0 * np.pi / 4 / count
    places = np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1)
    frame = frame_of(chain(100.0 / unit * places))
    load = np.zeros_like(frame.load)
    load[0, -1, 2] = 600.0
    inertia = 1e7 / 12.0 / unit**2
    section = stiffness(frame.rest, 1e7, 5e6 / 6.0 / unit**2, (inertia, inertia), shear=5e6)
    found = equilibrium(replace(frame, section=section, load=load))
    assert found.status == "converged"
    assert np.abs(found.force[1:] / 600.0).max() < 1e-8
    return unit * np.abs(found.u[-1])


def test_the_bend_of_45_degrees_converges_at_second_order_to_the_published_tip() -> None:
    coarse, fine = bend(16) - BEND, bend(32) - BEND
    assert (np.abs(fine) < 5e-4 * BEND).all()
    assert np.linalg.norm(coarse) == pytest.approx(4.0 * np.linalg.norm(fine), rel=0.1)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("turns", [0.5, 1.0, 2.0])
def test_an_end_moment_rolls_a_cantilever_into_a_circle(dimension: int, turns: float) -> None:
    count, rigidity = 24, 0.01
    places = np.zeros((count + 1, dimension))
    places[:, 0] = np.arange(count + 1)
    frame = frame_of(chain(places))
    # In space the bar bends about its weak axis and so does not buckle.
    section = stiffness(frame.rest, 10.0, 0.05, (rigidity, 0.1))
    if dimension == 2:
        section = np.ascontiguousarray(section[:, [0, 2, 3, 4]])
    load = np.zeros_like(frame.load)
    load[0, -1, -1] = 2.0 * np.pi * turns * rigidity / count
    found = equilibrium(replace(frame, section=section, load=load))
    assert found.status == "converged"
    # Beams of equal curvature are the chords of a circle.
    angle = 2.0 * np.pi * turns / count
    radius = 0.5 / np.sin(angle / 2.0)
    along = angle * np.arange(count + 1)
    circle = np.stack([np.sin(along), -np.cos(along)], axis=1)
    expected = radius * (circle - circle[0])
    assert places[:, :2] + found.u[:, :2] == pytest.approx(expected, abs=1e-8)
    if dimension == 2:
        assert found.u[-1, 2] == pytest.approx(2.0 * np.pi * turns, abs=1e-8)
    else:
        half = np.pi * turns
        assert np.abs(found.q[-1] @ [np.cos(half), 0.0, 0.0, np.sin(half)]) == pytest.approx(1.0)


AXIAL, FLEXURAL, HALF, RISE = 1.885e6, 9.27e3, 12.943, 0.386
"""Williams' toggle: lb, lb in^2, in (F. W. Williams, Q. J. Mech. Appl. Math. 17, 451, 1964)."""


def toggle(count: int, drive: str, amount: float) -> Equilibrium:
    """Return the response of Williams' toggle with `count` elements in each bar.

    The unit of length is HALF / count.
    """
    unit = HALF / count
    x = np.arange(2.0 * count + 1.0)
    places = np.stack([x, RISE / unit * (1.0 - np.abs(x - count) / count)], axis=1)
    down = [0.0, -1.0]
    problem = chain(
        places,
        supports=Supports(fixed=[0, 2 * count]),
        input=Input(nodes=[count], direction=down, drive=drive, amount=amount),
        output=Output(nodes=[count - 1], direction=down),
    )
    length = frame_of(problem).rest_length
    rigidity = FLEXURAL / unit**2 / length
    columns = [AXIAL / length, 4.0 * rigidity, 2.0 * rigidity, 4.0 * rigidity]
    section = np.stack(columns, axis=1)
    held = frame_of(problem).held.copy()
    held[count, 0] = 0
    return equilibrium(frame_of(problem, section=section, held=held))


def toggle_force(count: int, deflection: float) -> float:
    """Return the force that pushes the toggle down by a deflection, lb."""
    found = toggle(count, "displacement", deflection * count / HALF)
    assert found.status == "converged"
    return -float(found.force[count, 1])


def exact_toggle_force(deflection: float) -> float:
    """Return the same from the extensible elastica of one bar, by shooting."""
    angle, length = np.arctan2(RISE, HALF), np.hypot(HALF, RISE)

    def rod(_s: float, state: Array, thrust: float, shear: float) -> list[float]:
        _, _, turn, moment = state
        c, s = np.cos(turn), np.sin(turn)
        stretch = 1.0 + (thrust * c + shear * s) / AXIAL
        return [stretch * c, stretch * s, moment / FLEXURAL, stretch * (thrust * s - shear * c)]

    def missed(unknown: Array) -> Array:
        thrust, shear, moment = unknown * [1e3, 10.0, 100.0]
        path = solve_ivp(
            rod, (0.0, length), [0.0, 0.0, angle, moment], args=(thrust, shear), rtol=1e-11,
            atol=1e-11,
        )  # fmt: skip
        return path.y[:3, -1] - [HALF, RISE - deflection, angle]

    guess = np.array([-0.5 - deflection, -1.0, 0.1])
    found = root(missed, guess, tol=1e-12)
    assert np.abs(missed(found.x)).max() < 1e-9
    return float(-2.0 * 10.0 * found.x[1])


def test_williams_toggle_follows_the_elastica_beyond_its_limit_load() -> None:
    for deflection in (0.1, 0.25, 0.4, 0.6):
        exact = exact_toggle_force(deflection)
        coarse, fine = (toggle_force(count, deflection) - exact for count in (8, 16))
        assert fine == pytest.approx(0.0, abs=0.02 * exact)
        assert coarse == pytest.approx(4.0 * fine, rel=0.1)


def test_williams_toggle_snaps_at_its_limit_load() -> None:
    peak = minimize_scalar(
        lambda deflection: -toggle_force(32, deflection), bounds=(0.1, 0.35), method="bounded"
    )
    limit = -peak.fun
    assert limit == pytest.approx(34.0, abs=0.5)  # as in the figures of the literature
    assert toggle(32, "force", 0.995 * limit).status == "converged"
    beyond = toggle(32, "force", 1.005 * limit)
    assert beyond.status == "snapped"
    assert beyond.reached * 1.005 == pytest.approx(1.0, abs=0.01)


def lateral(count: int, factor: float) -> Equilibrium:
    """Return the response of a deep cantilever with the end load factor sqrt(EI GJ) / L^2."""
    places = np.zeros((count + 1, 3))
    places[:, 0] = np.arange(count + 1)
    frame = frame_of(chain(places))
    weak = 1e-3 * count**2
    twisting = 0.7 * weak
    load = np.zeros_like(frame.load)
    load[0, -1, 1] = factor * np.sqrt(weak * twisting) / count**2
    section = stiffness(frame.rest, 10.0, twisting, (1e4 * weak, weak))
    return equilibrium(replace(frame, section=section, load=load))


def largest_stable(respond: Callable[[float], Equilibrium], low: float, high: float) -> float:
    """Return the largest load with a stable path from rest, to 1e-4."""
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        if respond(middle).status == "converged":
            low = middle
        else:
            high = middle
    return low


def column(count: int, dimension: int, factor: float) -> Equilibrium:
    """Return the response of a straight cantilever to a thrust, in parts of Euler's load."""
    places = np.zeros((count + 1, dimension))
    places[:, 0] = np.arange(count + 1)
    frame = frame_of(chain(places))
    rigidity = 1e-3 * count**2
    section = stiffness(frame.rest, 1e4, 0.7 * rigidity, (rigidity, 2.0 * rigidity))
    if dimension == 2:
        section = np.ascontiguousarray(section[:, [0, 2, 3, 4]])
    load = np.zeros_like(frame.load)
    load[0, -1, 0] = -factor * np.pi**2 * rigidity / (2.0 * count) ** 2
    return equilibrium(replace(frame, section=section, load=load))


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_straight_column_buckles_at_the_load_of_euler(dimension: int) -> None:
    """Its path is straight, so that nothing but the axial forces changes before it buckles."""
    coarse, fine = (
        largest_stable(partial(column, count, dimension), 0.5, 1.5) for count in (8, 16)
    )
    assert fine == pytest.approx(1.0, abs=2e-3)
    assert (4.0 * fine - coarse) / 3.0 == pytest.approx(1.0, abs=2e-4)


def test_a_deep_cantilever_buckles_sideways_at_the_load_of_timoshenko() -> None:
    """S. P. Timoshenko and J. M. Gere, Theory of elastic stability, 1961, section 6.4."""
    critical = [largest_stable(partial(lateral, count), 3.0, 5.0) for count in (8, 16)]
    assert critical == pytest.approx([4.013, 4.013], rel=0.02)
    assert (4.0 * critical[1] - critical[0]) / 3.0 == pytest.approx(4.0126, rel=5e-4)
    beyond = lateral(16, 4.5)
    assert beyond.status == "snapped"
    assert 4.5 * beyond.reached == pytest.approx(critical[1], rel=0.01)


ARM, WEAK, STIFF, TWISTING = 240.0, 71240.0 * 0.54, 71240.0 * 1350.0, 71240.0 / 2.62 * 2.16
"""Right-angle frame of J. H. Argyris et al. (Comput. Methods Appl. Mech. Eng. 17/18, 1, 1979): mm,
N mm^2. Both arms have the section 30 x 0.6 mm, E = 71240 N/mm^2, Poisson's ratio 0.31 and
J = 30 0.6^3 / 3. The first arm is clamped, and the force at the end of the second one acts along
the first one."""


def right_angle(count: int, force: float, stiff: float = STIFF) -> Equilibrium:
    """Return the response of the right-angle frame with `count` elements in each arm.

    The unit of length is ARM / count; the frame is in the plane of x and y.
    """
    along, unit = np.arange(count + 1.0), ARM / count
    first = np.stack([along, 0.0 * along, 0.0 * along], axis=1)
    second = np.stack([count + 0.0 * along, -along, 0.0 * along], axis=1)
    frame = frame_of(chain(np.concatenate([first, second[1:]])))
    load = np.zeros_like(frame.load)
    load[0, -1, 0] = force
    axial, twisting = 71240.0 * 18.0, TWISTING / unit**2
    section = stiffness(frame.rest, axial, twisting, (stiff / unit**2, WEAK / unit**2))
    return equilibrium(replace(frame, section=section, load=load))


def exact_right_angle(sign: float) -> float:
    """Return its critical force in a sense, if it does not deform in its plane.

    The equations of a rod, linear in the deflection u out of the plane and the rotations a and b
    about x and y, with the moment m = F L of the force F in the first arm and F (L - s) in the
    second: the motion is that of a free end with u = 1.
    """

    def first(_s: float, state: Array, force: float) -> list[float]:
        a, b, u = state
        moment = force * ARM
        return [-b * moment / TWISTING, (force * (1.0 - u) + a * moment) / WEAK, -b]

    def second(s: float, state: Array, force: float) -> list[float]:
        a, b, u = state
        moment = force * (ARM - s)
        return [-b * moment / WEAK, (force * (1.0 - u) + a * moment) / TWISTING, -a]

    def missed(force: float) -> float:
        state = np.zeros(3)
        for arm in (first, second):
            path = solve_ivp(arm, (0.0, ARM), state, args=(force,), rtol=1e-10, atol=1e-13)
            state = path.y[:, -1]
        return float(state[2] - 1.0)

    return abs(float(brentq(missed, 0.5 * sign, 1.3 * sign)))


def test_the_right_angle_frame_of_argyris_buckles_sideways_at_the_published_load() -> None:
    """J. C. Simo and L. Vu-Quoc, Comput. Methods Appl. Mech. Eng. 58, 79 (1986): 1.088 N.

    Data and figure are those of the example `rightAngleFrame` of Exudyn, after K. Nachbagauer and
    J. Gerstmayr, J. Comput. Nonlinear Dyn. 9, 011013 (2014).
    """
    critical = largest_stable(partial(right_angle, 16), 0.5, 1.3)
    assert critical == pytest.approx(1.088, abs=5e-4)
    beyond = right_angle(16, 1.3)
    assert beyond.status == "snapped"
    assert 1.3 * beyond.reached == pytest.approx(critical, rel=0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_right_angle_frame_stiff_in_its_plane_buckles_as_the_equations_of_rods(
    sign: float,
) -> None:
    exact = exact_right_angle(sign)
    coarse, fine = (
        largest_stable(lambda force, n=n: right_angle(n, sign * force, 100.0 * STIFF), 0.5, 1.3)
        for n in (8, 16)
    )
    assert fine == pytest.approx(exact, rel=3e-3)
    assert (4.0 * fine - coarse) / 3.0 == pytest.approx(exact, rel=5e-4)
