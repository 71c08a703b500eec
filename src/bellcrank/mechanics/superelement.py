"""A design as its ports feel it: a superelement with a few coordinates, along the whole stroke."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.conditions import Linear
from bellcrank.mechanics.status import Status
from bellcrank.mechanics.substructure import Condensed, Substructure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.conditions import Conditions
    from bellcrank.mechanics.evaluator import UnloadedBeams
    from bellcrank.mechanics.grips import Grip
    from bellcrank.model import Design


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A stable equilibrium under conditions.

    Parameters
    ----------
    z : (m,)
        Generalised coordinates of the grips.
    displacement : (N, 2)
        Of all nodes.
    coordinates : (k,)
        What the conditions are about.
    force : (k,)
        From outside, by coordinate: positive if it does work when its coordinate grows. Of
        springs it is the force on the superelement, ``-k q``.
    energy
        Elastic, of the superelement alone.
    stiffness : (m, m)
        Tangent, by z, with what forces on turned blocks add; symmetric.
    asymmetry
        Largest difference between the stiffness as computed and its transpose, as a part of
        its largest entry: what rounding leaves of the reciprocity of Maxwell and Betti.
    """

    z: NDArray[np.float64]
    displacement: NDArray[np.float64]
    coordinates: NDArray[np.float64]
    force: NDArray[np.float64]
    energy: float
    stiffness: NDArray[np.float64]
    asymmetry: float


class Superelement:
    """A design moved and loaded at gripped nodes, and nowhere else; `follow` moves it.

    Parameters
    ----------
    design
    grips
        How nodes are gripped. Their coordinates, one grip after the other, are z (m,).
    measures : (k, m)
        The coordinates that conditions and forces are about: q = measures z; by default z.
    unloaded_beams, springs
        As for a `Substructure`.

    Raises
    ------
    InvalidSettings
        If the measures do not fit the grips, or as `Substructure`.

    Examples
    --------
    The input of the full crane slides along its direction, its output is left alone:

    >>> from bellcrank.mechanics.grips import Sliding
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> push = Sliding(crane.input.nodes, crane.input.direction)
    >>> pushed = Superelement(crane.full_design(), [push])
    >>> pushed.rest().stiffness.round(4)
    array([[9.6861]])
    """

    def __init__(
        self,
        design: Design,
        grips: Sequence[Grip],
        measures: ArrayLike | None = None,
        unloaded_beams: UnloadedBeams = "keep",
        *,
        springs: bool = False,
    ) -> None:
        gripped = np.concatenate([grip.nodes for grip in grips])
        self.design = design
        self.unloaded_beams: UnloadedBeams = unloaded_beams
        self.grips = tuple(grips)
        self.count = sum(grip.count for grip in grips)
        self.cut = Substructure(design, gripped, unloaded_beams, springs=springs)
        ends = np.cumsum([0, *(grip.count for grip in grips)]).tolist()
        self._parts = [slice(a, b) for a, b in pairwise(ends)]
        # What the input does not reach stays at rest, whatever is asked of it.
        at_rest = self.motions(np.zeros(self.count)).reshape(self.count, -1)
        self._dead = ~at_rest.any(axis=1)
        chosen = np.eye(self.count) if measures is None else np.array(measures, dtype=np.float64)
        if chosen.ndim != 2 or chosen.shape[1] != self.count:
            raise InvalidSettings(
                f"measures: expected shape (k, {self.count}), a column for each coordinate of the "
                f"grips, got {chosen.shape}"
            )
        chosen[:, self._dead] = 0.0
        self.measures: NDArray[np.float64] = chosen
        self._by_coordinate = np.linalg.pinv(chosen.T)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(k,) whether each coordinate belongs to what the input can reach at all."""
        return np.asarray(self.measures.any(axis=1))

    def motions(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m, N, 2) the motion of the nodes per coordinate, without the interior's."""
        motions = np.zeros((self.count, *self.design.problem.lattice.positions.shape))
        for grip, part in zip(self.grips, self._parts, strict=True):
            live = self.cut.active[grip.nodes]
            motions[part, grip.nodes] = grip.motions(z[part]) * live[:, None]
        return motions

    def place(self, z: NDArray[np.float64], displacement: NDArray[np.float64]) -> None:
        """Put the gripped nodes where their coordinates say."""
        for grip, part in zip(self.grips, self._parts, strict=True):
            live = self.cut.active[grip.nodes]
            displacement[grip.nodes] = grip.place(z[part]) * live[:, None]

    def condense(
        self,
        z: NDArray[np.float64],
        displacement: NDArray[np.float64],
        *,
        softened: bool = True,
        predicted: bool = False,
    ) -> Condensed | None:
        """Condense to z; what grips add to the stiffness by turning under force included.

        As `Substructure.condense`, whose keywords it has.
        """
        found = self.cut.condense(
            displacement, self.motions(z), softened=softened, predicted=predicted
        )
        if found is not None:
            for grip, part in zip(self.grips, self._parts, strict=True):
                found.stiffness[part, part] += grip.bend(z[part], found.nodal_force[grip.nodes])
            found.stiffness[self._dead, self._dead] = 1.0
        return found

    def state(
        self, z: NDArray[np.float64], displacement: NDArray[np.float64], found: Condensed
    ) -> State:
        """Gather what there is to say about an equilibrium, condensed there."""
        size = float(np.abs(found.stiffness).max())
        asymmetry = float(np.abs(found.stiffness - found.stiffness.T).max()) / size
        # In equilibrium the force by z is L' times that by coordinate.
        force = self._by_coordinate @ found.force
        return State(
            z=z,
            displacement=displacement,
            coordinates=self.measures @ z,
            force=force,
            energy=self.cut.energy(displacement),
            stiffness=0.5 * (found.stiffness + found.stiffness.T),
            asymmetry=asymmetry,
        )

    def rest(self) -> State:
        """Return the state at rest, without any force.

        Raises
        ------
        InvalidSettings
            If the interior is a mechanism, even while the gripped nodes are held.
        """
        z, displacement = np.zeros(self.count), np.zeros_like(self.cut.system.positions)
        found = self.condense(z, displacement)
        if found is None:
            raise InvalidSettings(
                f"{self.design.problem.name}: {Status.MECHANISM.message}, even while its ports "
                "are held"
            )
        return self.state(z, displacement, found)

    def linear(self, state: State, conditions: Conditions) -> Linear:
        """Return the linear equations around a state."""
        return Linear(state.stiffness, self.measures, conditions)
