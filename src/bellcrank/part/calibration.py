"""From struts to springs: the stiffness of the discrete model that stands for a real part.

A beam of the model has the stiffness 2 k, its strut E A / L, so k = E A / (2 L) sets the scale.
What decides how a design moves is the ratio of bending to stretching. Where two struts meet in
a joint that turns freely, bending them by an angle costs what two angular springs of
lambda = E I / (2 L) cost, with E I / L the bending stiffness of a strut; where n meet, the
springs in their cyclic order are stiffer against some motions and softer against others than
struts are, with a mean of lambda = E I / L (1 - 1 / n). Joints of a diluted lattice have few
struts that bear load. Over some hundred designs from searches, a factor a little above one half
makes efficiencies agree best with frames (`docs/validation.md` has the figures):

    lambda / k = 2 JOINT I / (A L^2) = JOINT w^2 / (6 L^2)

for struts of width w; a material has no part in it. The paper's k = 5 and lambda = 0.1 are those
of struts almost half as wide as they are long.
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
"""lambda in units of E I / L, by fit; 1/2 for two struts in a joint, 5/6 on average for six."""


def calibrated(problem: Problem, width: float, scale: float = 10.0) -> Problem:
    """Return a problem whose springs stand for struts of some width.

    Beams keep their stiffness, so that forces and output springs of the problem strain the
    struts as they strain the beams; angular springs change.

    Parameters
    ----------
    width
        Of the struts, mm.
    scale
        Length of a lattice unit, mm.

    Raises
    ------
    InvalidSettings
        If struts are wider than they are long.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> round(calibrated(crane, 2.0).stiffness.angle, 5), crane.stiffness.angle
    (0.01833, 0.1)
    >>> round(equivalent_width(crane), 2)  # the struts that the paper's stiffness stands for
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
    """Return the width in mm of struts that bend and stretch as a problem's springs do."""
    stiffness = problem.stiffness
    return float(scale * np.sqrt(6.0 * stiffness.angle / (JOINT * stiffness.bond)))
