"""Blocks: fixed numbers of proposals, between which a chain can be stopped and resumed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.storage import Proposals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Response
    from bellcrank.model import Problem
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.settings import SearchSettings

BLOCK = 250
"""Steps between two states at which a chain can be stopped and resumed."""


def random_numbers(seed: int, chain: int, block: int) -> np.random.Generator:
    """Return the random number generator of one block of one chain."""
    sequence = np.random.SeedSequence(seed, spawn_key=(chain, block))
    return np.random.Generator(np.random.Philox(sequence))


def steps_in_block(settings: SearchSettings, step: int) -> int:
    """Return the number of steps of the block that starts at `step`."""
    return min(BLOCK, settings.steps - step)


def initial_response(evaluator: Evaluator) -> Response:
    """Return the response of the initial design, from which a search starts.

    Raises
    ------
    InvalidSettings
        If the problem has no support, or its initial design no unique, stable response.
    """
    problem = evaluator.problem
    if not len(problem.supports.nodes):
        raise InvalidSettings(
            f"problem {problem.name!r}: supports: expected at least one supported node, got none; "
            "without a support nothing resists the input, and no design can be compared"
        )
    response = evaluator.evaluate(problem.initial)
    if not response.is_admissible:
        raise InvalidSettings(
            f"problem {problem.name!r}: the search cannot start from the initial design: "
            f"{response.status.message}"
        )
    return response


@dataclass(slots=True)
class ProposalRows:
    """Proposals of a block, one row for each."""

    mask: list[NDArray[np.uint8]] = field(default_factory=list)
    efficiency: list[float] = field(default_factory=list)
    cost: list[float] = field(default_factory=list)
    temperature: list[float] = field(default_factory=list)
    accepted: list[bool] = field(default_factory=list)
    status: list[int] = field(default_factory=list)

    def add(
        self,
        mask: NDArray[np.bool_],
        efficiency: float,
        cost: float,
        temperature: float,
        accepted: bool,
        status: int,
    ) -> None:
        """Append one proposal."""
        self.mask.append(np.packbits(mask))
        self.efficiency.append(efficiency)
        self.cost.append(cost)
        self.temperature.append(temperature)
        self.accepted.append(accepted)
        self.status.append(status)

    def extend(self, proposals: Proposals) -> None:
        """Append the rows of other proposals."""
        self.mask.extend(proposals.mask)
        self.efficiency.extend(proposals.efficiency.tolist())
        self.cost.extend(proposals.cost.tolist())
        self.temperature.extend(proposals.temperature.tolist())
        self.accepted.extend(proposals.accepted.tolist())
        self.status.extend(proposals.status.tolist())

    def __len__(self) -> int:
        return len(self.status)

    def proposals(self, problem: Problem) -> Proposals:
        """Return the proposals as columns."""
        width = (problem.lattice.beam_count + 7) // 8
        return Proposals(
            np.array(self.mask, dtype=np.uint8).reshape(-1, width),
            np.array(self.efficiency, dtype=np.float64),
            np.array(self.cost, dtype=np.float64),
            np.array(self.temperature, dtype=np.float64),
            np.array(self.accepted, dtype=np.bool_),
            np.array(self.status, dtype=np.int8),
        )
