"""Removal of beams that carry no load: loose pieces, dead ends, parts held at a single node."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import loaded_beams, model_evaluator

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import ModelEvaluator
    from bellcrank.model import Design, Problem


def pieces(problem: Problem, mask: NDArray[np.bool_]) -> int:
    """Return the number of connected pieces of a design."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    beams = problem.lattice.beams[mask]
    used, local = np.unique(beams, return_inverse=True)
    local = local.reshape(beams.shape)
    graph = coo_matrix((np.ones(len(beams)), local.T), shape=(len(used), len(used)))
    return int(connected_components(graph, directed=False)[0])


def clean(design: Design, evaluator: ModelEvaluator | None = None) -> Design:
    """Return a design without the beams that carry no load.

    Loose pieces and dead ends are removed first, then parts connected by a single node or to
    supports only. In the spring model dead ends soften the joint that they are attached to; in a
    real part all of these are unloaded mass. A beam that carries load in one load case remains.

    Parameters
    ----------
    evaluator
        An evaluator of the design's problem; pass one when many designs are cleaned.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane").full_design()
    >>> clean(crane).beam_count
    352
    """
    evaluator = evaluator or model_evaluator(design.problem, "displacement")
    core = evaluator.load_bearing(design.mask)
    for case in list(design.problem.cases.values())[1:]:
        core = core | model_evaluator(case, "displacement").load_bearing(design.mask)
    if design.problem.section is None:
        core = loaded_beams(design.problem, core)
    return design.with_mask(core)
