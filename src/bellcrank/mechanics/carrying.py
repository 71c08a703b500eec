"""Questions about a design beside its efficiency: what carries load, how stiff is the output."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.system import allocate_structure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.evaluator import Evaluator


class Core:
    """Finds the load-bearing part of designs, without their response.

    As `Evaluator.load_bearing`, ten times faster, and what the evaluator keeps of the
    response it computed last stays as it is.

    Examples
    --------
    >>> from bellcrank.mechanics import Evaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> int(Core(Evaluator(crane)).of(crane.initial).sum())
    352
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._system = evaluator.system
        self._structure = allocate_structure(evaluator.system)

    def of(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (M,) which beams of a design are neither loose nor dead ends."""
        from bellcrank.mechanics.kernels.carrying import find_core

        core = np.zeros(len(mask), np.uint8)
        find_core(self._system, mask.astype(np.uint8), self._structure, core)
        return core.astype(bool)


def output_stiffness(evaluator: Evaluator) -> float:
    """Return how the output of the design evaluated last resists a small force.

    ``1 / (t' K^-1 t)``, with K the tangent stiffness at full load and t the mean of the wanted
    directions over the output nodes that the structure holds: a small force F, shared
    equally by these nodes, moves their mean by F over this stiffness. The input is held
    if it is driven by a displacement, and free under its force if by one; the output's own
    springs count.

    Returns
    -------
    float
        In units of bond stiffness; 0 if the structure does not hold the output, or not stably.

    Examples
    --------
    >>> from bellcrank.mechanics import Evaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> evaluator = Evaluator(crane)
    >>> response = evaluator.respond(crane.initial)
    >>> round(output_stiffness(evaluator), 3)
    5.745
    """
    from bellcrank.mechanics.kernels.carrying import output_compliance

    compliance = output_compliance(
        evaluator.system, evaluator.structure, evaluator.displacement, evaluator.scratch
    )
    return 1.0 / compliance if compliance > 0.0 else 0.0
