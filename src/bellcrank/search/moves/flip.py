"""Remove or add one beam, any with the same chance: the paper's move."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.search.moves.registry import moves

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.search.place import Place


class Flip:
    """Flip a designable beam, each with the same chance."""

    def propose(self, here: Place, rng: np.random.Generator) -> NDArray[np.int64] | None:
        """Choose a beam."""
        designable = here.problem.designable
        index = int(rng.random() * len(designable))
        return designable[index : index + 1]

    def log_chance(self, here: Place, beams: NDArray[np.int64]) -> float:  # noqa: ARG002
        """Equal in both directions."""
        return 0.0


moves.register("flip")(Flip())
