"""Initial designs of large lattices: the results of searches on coarser ones.

From the full lattice, a search needs hundreds of flips before the output moves at all, and each of
them costs a response of the whole lattice. On a lattice of straight chains of beams
(`bellcrank.model.coarse`) there are fewer flips, and a response costs less.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator, SpringEvaluator
from bellcrank.model import unpack_mask
from bellcrank.model.coarse import coarse_problems
from bellcrank.search.constraints.evaluator import ConstrainedEvaluator
from bellcrank.search.evaluator import make_evaluator
from bellcrank.search.hopping.state import HoppingState
from bellcrank.search.registry import chain_blocks
from bellcrank.search.specification import SpecificationEvaluator

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.hopping.settings import HoppingSettings
    from bellcrank.search.symmetry import SymmetryGroups

STRIDES = (2, 3)
"""Numbers of beams in a chain, of which the first counts that leaves few flips, else the last."""
FEW_BEAMS = 1000
"""Number of designable beams above which a coarse lattice is made coarser in turn."""


def coarse_start(
    evaluator: Evaluator, settings: HoppingSettings, chain: int
) -> NDArray[np.bool_] | None:
    """Return the design that a search on a coarser lattice finds.

    None if the lattice has at most `HoppingSettings.coarse_beams` designable beams, no straight
    chains of them, or no coarse design that is admissible.

    Parameters
    ----------
    evaluator
        Evaluator of the search; that of a network has no coarser problem.
    settings
        Settings of the search, also on the coarser lattice.
    chain
        Number of the chain.
    """
    if len(evaluator.problem.designable) <= settings.limits(evaluator.problem).coarse_beams:
        return None
    problem = _whole(evaluator)
    if problem is None:
        return None
    few = min(FEW_BEAMS, settings.limits(problem).coarse_beams)
    own = replace(settings, steps=min(settings.coarse_steps, settings.steps), coarse_beams=few)
    for stride in STRIDES:
        for coarse in coarse_problems(problem, stride):
            try:
                other = make_evaluator(coarse.problem, own)
            except (InvalidProblem, InvalidSettings):
                # The coarse lattice is not symmetric as demanded.
                continue
            if stride != STRIDES[-1] and len(other.problem.designable) > few:
                break
            found = _result(other, own, chain)
            if found is None:
                continue
            mask = coarse.original(found)
            if evaluator.evaluate(mask, VERIFICATION_INCREMENT).is_admissible:
                return mask
    return None


def _groups(evaluator: Evaluator) -> SymmetryGroups | None:
    """Return the groups in which beams are flipped; None if each is flipped alone."""
    if isinstance(evaluator, ConstrainedEvaluator | SpecificationEvaluator):
        return evaluator.groups
    return None


def _whole(evaluator: Evaluator) -> Problem | None:
    """Return the problem of an evaluator with all designable beams of symmetric designs."""
    groups = _groups(evaluator)
    if groups is not None:
        return replace(evaluator.problem, designable=groups.members)
    known = isinstance(evaluator, SpringEvaluator | FrameEvaluator)
    return evaluator.problem if known else None


def _result(
    evaluator: Evaluator, settings: HoppingSettings, chain: int
) -> NDArray[np.bool_] | None:
    """Return the best design of a search; None if it cannot start."""
    try:
        *_, (state, _) = chain_blocks(evaluator, settings, chain)
    except InvalidSettings:
        return None
    assert isinstance(state, HoppingState)
    mask = unpack_mask(state.mask, evaluator.problem.lattice.beam_count)
    groups = _groups(evaluator)
    return mask if groups is None else groups.expand(mask)
