"""Calibration of the spring model: the spring stiffness equivalent to struts of a part.

A beam of the model has the stiffness 2 k and a strut E A / L, so that k = E A / (2 L) determines
the scale. The motion of a design depends on the ratio of bending to stretching stiffness. If two
struts meet at a freely rotating joint, bending them by an angle is equivalent to two angular
springs of lambda = E I / (2 L), where E I / L is the bending stiffness of a strut. If n struts
meet, angular springs in cyclic order are stiffer against some motions and softer against others,
with the mean lambda = E I / L (1 - 1 / n). Joints of a diluted lattice have few loaded struts. A
factor slightly above one half gives the best agreement of efficiencies with frames over about a
hundred designs of searches (figures in `docs/validation.md`):

    lambda / k = 2 JOINT I / (A L^2) = JOINT w^2 / (6 L^2)

for struts of width w, independent of the material. The paper's k = 5 and lambda = 0.1 correspond
to struts whose width is almost half their length.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model.conditions import Stiffness

if TYPE_CHECKING:
    from bellcrank.model import Problem

JOINT = 0.55
"""Fitted lambda in units of E I / L; 1/2 for two struts at a joint, 5/6 on average for six."""


def calibrated(problem: Problem, width: float, scale: float = 10.0) -> Problem:
    """Return a problem whose springs are equivalent to struts of a given width.

    The stiffness of the beams is unchanged, so that forces and output springs of the problem
    strain the struts as they strain the beams. The angular springs change.

    Parameters
    ----------
    problem
        The problem.
    width
        Strut width, mm.
    scale
        Length of a lattice unit, mm.

    Raises
    ------
    InvalidSettings
        If the struts are wider than long.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> round(calibrated(crane, 2.0).stiffness.angle, 5), crane.stiffness.angle
    (0.01833, 0.1)
    >>> round(equivalent_width(crane), 2)  # struts equivalent to the paper's stiffness
    4.67
    """
    length = float(np.mean(problem.lattice.rest_length))
    if not 0.0 < width < length * scale:
        raise InvalidSettings(
            f"width: expected more than 0 and less than the spacing of "
            f"{length * scale:g} mm, got {width:g} mm"
        )
    bond = problem.stiffness.bond
    angle = bond * JOINT * (width / scale) ** 2 / 6.0
    return replace(problem, stiffness=Stiffness(bond, angle))


def equivalent_width(problem: Problem, scale: float = 10.0) -> float:
    """Return the width, mm, of the struts that the springs of a problem are equivalent to."""
    stiffness = problem.stiffness
    return float(scale * np.sqrt(6.0 * stiffness.angle / (JOINT * stiffness.bond)))
