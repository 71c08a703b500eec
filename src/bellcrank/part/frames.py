"""Frames that represent parts in the lattice units of a problem.

The beams of a frame get the cross-section of the struts in lattice units, Poisson's ratio of the
material, and a Young's modulus of ``E A / L = 2 k``, where L is the mean length of the beams and
2 k the stiffness of a beam of the spring model. Forces and output springs of the problem then
strain the struts as they strain the beams of the spring model, and `Part.stiffness_unit` converts
them to N.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import Elasticity, Section, Stiffness, require_plane
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.model import Lattice, Problem
    from bellcrank.part.spec import PartSpec

models: Registry[Callable[[Problem, PartSpec], Problem]] = Registry("model")
"""Mechanical models: functions from a problem and a part to the problem in that model."""


def frame_problem(problem: Problem, spec: PartSpec) -> Problem:
    """Return the problem whose beams are the struts of parts.

    Parameters
    ----------
    problem
        The problem, of the spring model or of a frame.
    spec
        Size and material of the parts; in space the width is the diameter of round struts.

    Raises
    ------
    InvalidSettings
        If a beam is not longer than wide.
    UnknownName
        If there is no such material.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.part import PartSpec
    >>> frame = frame_problem(find_problem("crane"), PartSpec(width=2.0, thickness=5.0))
    >>> frame.section
    Section(width=0.2, thickness=0.5, shape='rectangle', joint=0.06)
    >>> round(frame.material.young * frame.section.area, 9), frame.material.poisson
    (10.0, 0.48)
    """
    _check_slender(problem, spec)
    section = frame_section(spec, problem.lattice.dimension)
    widths, joints = problem.widths, problem.joints
    if problem.section is None:
        material = frame_elasticity(problem.lattice, section, spec, problem.stiffness)
    else:
        assert problem.material is not None
        # Loads and bounds are in units of the stiffness of the beams, which has to stay.
        young = problem.material.young * problem.section.area / section.area
        material = Elasticity(young, spec.registered_material.poisson)
        ratio = section.width / problem.section.width
        widths = None if widths is None else widths * ratio
        joints = joints * ratio if joints is not None and spec.keeps_joints(problem) else None
    return replace(problem, section=section, material=material, widths=widths, joints=joints)


def frame_section(spec: PartSpec, dimension: int) -> Section:
    """Return the cross-section of the struts of parts, in lattice units.

    Examples
    --------
    >>> from bellcrank.part import PartSpec
    >>> frame_section(PartSpec(), 3).shape
    'round'
    """
    return spec.section(dimension).scaled(1.0 / spec.scale)


def frame_elasticity(
    lattice: Lattice, section: Section, spec: PartSpec, stiffness: Stiffness | None = None
) -> Elasticity:
    """Return the material of frames, whose beams are as stiff as those of the spring model.

    Parameters
    ----------
    lattice, section
        Those of the problem.
    spec
        Size and material of the parts.
    stiffness
        Stiffness of the spring model; its default if it is not given.
    """
    bond = (stiffness or Stiffness()).bond
    young = 2.0 * bond * float(np.mean(lattice.rest_length)) / section.area
    return Elasticity(young, spec.registered_material.poisson)


def _check_slender(problem: Problem, spec: PartSpec) -> None:
    """Raise InvalidSettings if a beam that may be present is not longer than wide."""
    possible = problem.initial.copy()
    possible[problem.designable] = True
    shortest = float(problem.lattice.rest_length[possible].min(initial=math.inf)) * spec.scale
    if spec.width >= shortest:
        raise InvalidSettings(
            f"width: struts {spec.width:g} mm wide are not slender where the shortest is "
            f"{shortest:g} mm long; choose narrower struts or a larger scale"
        )


def spring_problem(problem: Problem) -> Problem:
    """Return the problem of the spring model: the same without section and material.

    Raises
    ------
    InvalidProblem
        If the problem is in space.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.part import PartSpec
    >>> crane = find_problem("crane")
    >>> spring_problem(frame_problem(crane, PartSpec())).hash == crane.hash
    True
    """
    require_plane(problem, "spring model")
    return replace(problem, section=None, material=None, widths=None, joints=None)


@models.register("springs")
def in_springs(problem: Problem, _spec: PartSpec) -> Problem:
    """Return the problem of the spring model; see `spring_problem`."""
    return spring_problem(problem)


@models.register("frames")
def in_frames(problem: Problem, spec: PartSpec) -> Problem:
    """Return a problem of a frame unchanged, and that of the spring model as one of the part."""
    return frame_problem(problem, spec) if problem.section is None else problem
