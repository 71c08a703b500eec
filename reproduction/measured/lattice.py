"""The measured lattice and its mechanical models.

Data and their licence are in `reproduction/data/triangular-lattice`. Lengths of the data are in m,
those of problems in spacings of the lattice; forces are in N.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.mechanics import FrameEvaluator, SpringEvaluator, Status
from bellcrank.model import (
    Elasticity,
    Input,
    Lattice,
    Loads,
    NodeSpring,
    Output,
    Problem,
    Section,
    Stiffness,
    Supports,
)
from bellcrank.part import Part
from bellcrank.part.materials import Material

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

DATA = Path(__file__).parents[1] / "data" / "triangular-lattice" / "measured.json"
HINGE = 1e6
"""Stiffness of the springs that hold supports free to turn, over that of a strut."""
SMALL = 0.01
"""Part of a force at which the response of springs is linear: to 1e-6."""
ELEMENTS = 8
"""Elements in each strut of nonlinear frames."""
GRAVITY = 9.81
"""m / s^2."""

Force = tuple[int, tuple[float, float]]
"""Node and force in N."""


@cache
def data() -> dict[str, Any]:
    """Return the data."""
    found: dict[str, Any] = json.loads(DATA.read_text(encoding="utf-8"))
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """Dimensions and material of the printed lattice.

    Parameters
    ----------
    young
        Young's modulus, MPa.
    width, thickness
        Dimensions of the struts, mm.
    joint
        Length of the ends of struts that do not bend in frames, mm.
    density
        Density of the own weight, g / cm^3.
    poisson
        Poisson's ratio; the source gives none, and only the sheet depends on it.
    """

    young: float = 0.55
    width: float = 2.0
    thickness: float = 2.0
    joint: float = 0.0
    density: float = 0.0
    poisson: float = 0.45


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A mechanical model.

    Parameters
    ----------
    kind
        ``"bars"``: springs along the struts, hinged in the nodes; ``"springs"``: the discrete
        model of the package, with angular springs of EI / 2 L; ``"frame"``; ``"sheet"``.
    clamped
        Whether the supports of frames and of the sheet are clamped or free to turn.
    nonlinear
        Whether displacements are large.
    """

    kind: str
    clamped: bool = True
    nonlinear: bool = False


MODELS: dict[str, Model] = {
    "bars": Model(kind="bars"),
    "springs": Model(kind="springs", nonlinear=True),
    **{
        f"{kind}-{support}-{size}": Model(
            kind=kind, clamped=support == "clamped", nonlinear=size == "nonlinear"
        )
        for kind in ("frame", "sheet")
        for support in ("free", "clamped")
        for size in ("linear", "nonlinear")
    },
}
"""All models by name."""


def spacing() -> float:
    """Return the distance of neighbours, mm."""
    first, last = (1e3 * np.array(data()["positions"][k]) for k in data()["beams"][0])
    return float(np.linalg.norm(last - first))


def problem_of(sample: Sample, force: Force, *, clamped: bool = True) -> Problem:
    """Return the frame problem of the lattice under one force.

    Displacements are in spacings, forces in N.
    """
    given, unit = data(), spacing()
    node, vector = force
    size = float(np.hypot(*vector))
    held = np.array(given["supports"])
    young = sample.young * unit**2
    section = Section(sample.width / unit, sample.thickness / unit, joint=sample.joint / unit)
    weight = None
    if sample.density:
        # g / cm^3 is 1e-6 kg / mm^3.
        weight = np.array([0.0, -1e-6 * sample.density * GRAVITY * unit**3])
    springs: tuple[NodeSpring, ...] = ()
    if not clamped:
        stiffness = HINGE * young * section.area
        springs = tuple(NodeSpring(held, axis, stiffness) for axis in np.eye(2))
    others = [k for k in range(len(given["positions"])) if k not in {node, *given["supports"]}]
    return Problem(
        name="triangular-lattice",
        lattice=Lattice(1e3 * np.array(given["positions"]) / unit, np.array(given["beams"])),
        supports=Supports(fixed=held) if clamped else Supports(),
        input=Input(
            nodes=np.array([node]), direction=np.array(vector) / size, drive="force", amount=size
        ),
        # All nodes, so that the sheet has their displacements.
        output=Output(nodes=np.array(others), direction=np.array([0.0, -1.0])),
        section=section,
        material=Elasticity(young, sample.poisson),
        loads=Loads(springs=springs, weight=weight),
        designable=np.array([0]),
    )


def displacement_of(model: Model, sample: Sample, force: Force, moment: float = 0.0) -> Floats:
    """Return (N, 2) the displacement of the nodes under one force, m.

    Parameters
    ----------
    moment
        Moment on the loaded node of a linear frame, N m.

    Raises
    ------
    ArithmeticError
        If the response is not stable.
    """
    metre = 1e-3 * spacing()
    if model.kind in {"bars", "springs"}:
        return metre * _by_springs(model, sample, force)
    problem = problem_of(sample, force, clamped=model.clamped)
    if model.kind == "sheet":
        return _by_sheet(problem, sample, nonlinear=model.nonlinear)
    evaluator = FrameEvaluator(problem, elements=ELEMENTS if model.nonlinear else None)
    if model.nonlinear:
        response = evaluator.evaluate(problem.initial)
        if response.status is not Status.CONVERGED:
            raise ArithmeticError(response.status.message)
        return metre * response.displacement
    rest = evaluator.at_rest(problem.initial)
    assert rest is not None
    load = rest.fields(1)[0]
    load[force[0]] = [*force[1], moment / metre]
    motion = rest.solve(load)
    assert motion is not None
    found: Floats = metre * motion[:, :2]
    return found


def _by_springs(model: Model, sample: Sample, force: Force) -> Floats:
    """Return (N, 2) displacements of the spring model, spacings."""
    problem = problem_of(sample, force)
    assert problem.section is not None
    assert problem.material is not None
    axial = problem.material.young * problem.section.area
    bending = problem.material.young * problem.section.inertia
    angle = 1e-9 * axial if model.kind == "bars" else 0.5 * bending
    springs = replace(problem, section=None, material=None, stiffness=Stiffness(0.5 * axial, angle))
    if model.nonlinear:
        return SpringEvaluator(springs).evaluate(springs.initial).displacement
    # The mean of a small push and pull has no second-order part.
    small = [
        SpringEvaluator(
            replace(
                springs,
                input=replace(
                    springs.input, amount=SMALL * springs.input.amount,
                    direction=sign * springs.input.direction,
                ),
            )
        ).evaluate(springs.initial).displacement
        for sign in (1.0, -1.0)
    ]  # fmt: skip
    linear: Floats = (small[0] - small[1]) / (2.0 * SMALL)
    return linear


def _by_sheet(problem: Problem, sample: Sample, *, nonlinear: bool) -> Floats:
    """Return (N, 2) mean displacements of hubs in plane stress, m."""
    from bellcrank.fem.continuum.response import solve_plane

    material = Material(name="measured", young=sample.young, poisson=sample.poisson)
    section = Section(sample.width, sample.thickness)
    part = Part(problem.full_design(), material, section, spacing())
    response = solve_plane(part, "neo-hookean" if nonlinear else "linear")
    last = response.states[-1]
    if last.load < 1.0:
        raise ArithmeticError(response.path.status.message)
    found: Floats = 1e-3 * last.motion
    return found


def elongations(displacement: Floats, *, nonlinear: bool) -> Floats:
    """Return (M,) the elongation of all struts, m.

    Parameters
    ----------
    displacement : (N, 2)
        Displacements, m.
    nonlinear
        Whether it is the change of the distance, or its first-order part.
    """
    rest, beams = np.array(data()["positions"]), np.array(data()["beams"])
    along = rest[beams[:, 1]] - rest[beams[:, 0]]
    change = displacement[beams[:, 1]] - displacement[beams[:, 0]]
    length = np.linalg.norm(along, axis=1)
    if not nonlinear:
        first: Floats = (along * change).sum(axis=1) / length
        return first
    whole: Floats = np.linalg.norm(along + change, axis=1) - length
    return whole


def mirrored() -> NDArray[np.int64]:
    """Return (M,) the mirror image of each strut."""
    rest = np.array(data()["positions"])
    middle = 0.5 * (rest[:, 0].min() + rest[:, 0].max())
    images = rest * [-1.0, 1.0] + [2.0 * middle, 0.0]
    node = [int(np.argmin(np.hypot(*(rest - image).T))) for image in images]
    number = {frozenset(pair): k for k, pair in enumerate(data()["beams"])}
    return np.array([number[frozenset((node[a], node[b]))] for a, b in data()["beams"]])
