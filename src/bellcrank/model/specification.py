"""Specification of a problem: load cases, items that a design must meet, and an objective."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import locked, real_array, rebuild
from bellcrank.model.loads import Loads

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model.conditions import Input, Output, Supports
    from bellcrank.model.tolerances import Tolerances

Dimension = Literal["ratio", "length", "angle", "force", "stiffness", "volume"]
Scope = Literal["output", "case", "design"]
Reduction = Literal["every", "largest", "smallest", "spread"]

FOLDS = {"2-fold": 2, "3-fold": 3, "4-fold": 4, "6-fold": 6}
"""Rotational symmetry about the vertical axis: number of equal parts of a turn."""
SYMMETRIES = ("x", "y", "z", *FOLDS)
"""Names of symmetries; a letter is the axis along which mirror images are exchanged."""


class QuantityType(NamedTuple):
    """What is known of a quantity before it is computed."""

    dimension: Dimension
    scope: Scope
    """Whether it belongs to an output, to a case, or to the design."""
    along: bool
    """Whether it has a value at every state of the stroke."""
    meaning: str


QUANTITIES: dict[str, QuantityType] = {
    "gain": QuantityType(
        "ratio", "output", True,
        "mean motion of the output along its direction over that of the input",
    ),
    "travel": QuantityType(
        "length", "output", True, "mean motion of the output along its direction"
    ),
    "off_axis": QuantityType(
        "ratio", "output", False,
        "largest motion of the output normal to its direction along the stroke, over its travel "
        "at full stroke",
    ),
    "rotation": QuantityType(
        "angle", "output", True, "rotation of the output, counter-clockwise (in space its size)"
    ),
    "path_error": QuantityType(
        "ratio", "output", False,
        "root mean square distance between the path of the output and the wanted path, over the "
        "length of the latter",
    ),
    "stiffness": QuantityType(
        "stiffness", "output", False, "stiffness of the output along its direction at full stroke"
    ),
    "payload": QuantityType(
        "force", "output", False,
        "force against the direction of the output that halves its travel",
    ),
    "dead_load": QuantityType(
        "force", "output", False,
        "force against the direction of the output that acts before the input and halves its "
        "travel",
    ),
    "blocked_force": QuantityType(
        "force", "output", False, "force of the output on a stop that prevents its travel"
    ),
    "sag": QuantityType(
        "ratio", "output", False,
        "motion of the output by the own weight at rest, over its travel at full stroke",
    ),
    "input_force": QuantityType("force", "case", True, "force of the input along its direction"),
    "strain": QuantityType("ratio", "case", True, "largest principal strain of a strut"),
    "clearance": QuantityType(
        "length", "case", False, "smallest gap between struts that do not meet, along the stroke"
    ),
    "stable_stroke": QuantityType(
        "ratio", "case", False, "part of the stroke up to which the equilibrium is stable"
    ),
    "strut_loss": QuantityType(
        "ratio", "design", False,
        "largest part of the efficiency of the first output that the loss of a single strut costs; "
        "2 at most, and where the full stroke is not reached",
    ),
    "mass": QuantityType("volume", "design", False, "volume of all struts"),
}  # fmt: skip
"""Quantities that items may bound, by name."""
CARRIED = ("payload", "dead_load")
"""Those that are forces on an output, extrapolated from the motion under the wanted one."""
ONLY_BOUNDED = ("path_error", "clearance", "stable_stroke", "strut_loss", "mass")
"""Those that are no objectives."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Item:
    """A quantity and its bounds.

    Parameters
    ----------
    quantity
        Name in `QUANTITIES`.
    case, output
        Names of the load case and of its output; empty where the quantity belongs to neither.
    of
        For a quantity with a value at every state of the stroke: ``"every"`` value between
        `start` and `stop` is bounded, the ``"largest"`` one, the ``"smallest"`` one, or the
        ``"spread"``: largest less smallest value over the size of their mean.
    start, stop
        Fractions of the full input; both 1 for the full stroke alone.
    at_least, at_most
        Bounds in the units of the problem, angles in degrees; None for no bound.
    path : (k, 2) float64
        Corners of the wanted path from the rest position of the output, for `path_error`.

    Raises
    ------
    InvalidProblem
        If the quantity is unknown, or a value is outside its range.

    Examples
    --------
    >>> item = Item(quantity="rotation", case="push", output="tip", at_least=-5.0, at_most=5.0)
    >>> item.name
    'push.tip.rotation'
    """

    quantity: str
    case: str = ""
    output: str = ""
    of: Reduction = "every"
    start: float = 1.0
    stop: float = 1.0
    at_least: float | None = None
    at_most: float | None = None
    path: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise InvalidProblem(
                f"items: unknown quantity {self.quantity!r}; known: {', '.join(QUANTITIES)}"
            )
        if self.of not in get_args(Reduction):
            raise InvalidProblem(
                f"items: {self.quantity}.of: expected one of {', '.join(get_args(Reduction))}, "
                f"got {self.of!r}"
            )
        if not 0.0 <= self.start <= self.stop <= 1.0:
            raise InvalidProblem(
                f"items: {self.quantity}: expected fractions of the stroke from 0 to 1 in "
                f"ascending order, got {self.start!r} and {self.stop!r}"
            )
        for name in ("at_least", "at_most"):
            bound = getattr(self, name)
            if bound is not None and not math.isfinite(bound):
                raise InvalidProblem(
                    f"items: {self.quantity}.{name}: expected a finite number, got {bound!r}"
                )
        if self.at_least is None and self.at_most is None:
            raise InvalidProblem(f"items: {self.quantity}: expected at_least, at_most or both")
        if None not in (self.at_least, self.at_most) and self.at_least > self.at_most:  # type: ignore[operator]
            raise InvalidProblem(
                f"items: {self.quantity}: at_least {self.at_least!r} exceeds at_most "
                f"{self.at_most!r}"
            )
        if (self.path is not None) != (self.quantity == "path_error"):
            raise InvalidProblem("items: path_error has a path, and no other quantity has")
        if self.path is not None:
            path = real_array("items: path", self.path)
            if path.ndim != 2 or path.shape[1] != 2 or len(path) < 2:
                raise InvalidProblem(
                    "items: path: expected at least two points [x, y] from the rest position, "
                    f"got shape {path.shape}"
                )
            object.__setattr__(self, "path", locked(path))

    __reduce__ = rebuild

    @property
    def name(self) -> str:
        """Case, output and quantity, separated by dots."""
        return ".".join(part for part in (self.case, self.output, self.quantity) if part)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; values that equal their defaults are left out."""
        data: dict[str, Any] = {"quantity": self.quantity}
        for name, default in (
            ("case", ""), ("output", ""), ("of", "every"), ("start", 1.0), ("stop", 1.0),
            ("at_least", None), ("at_most", None),
        ):  # fmt: skip
            if (value := getattr(self, name)) != default:
                data[name] = value
        if self.path is not None:
            data["path"] = self.path.tolist()
        return data


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectiveTerm:
    """A quantity to maximise once all items are met.

    Parameters
    ----------
    quantity, case, output
        As in `Item`.
    scale
        Unit in which it is compared with other objectives; negative to minimise it.
    """

    quantity: str
    case: str = ""
    output: str = ""
    scale: float = 1.0

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise InvalidProblem(
                f"maximise: unknown quantity {self.quantity!r}; known: {', '.join(QUANTITIES)}"
            )
        if self.quantity in ONLY_BOUNDED:
            raise InvalidProblem(f"maximise: {self.quantity}: expected a bound, not an objective")
        if not math.isfinite(self.scale) or self.scale == 0.0:
            raise InvalidProblem(
                f"maximise: {self.quantity}.scale: expected a finite number other than 0, got "
                f"{self.scale!r}"
            )

    @property
    def item(self) -> Item:
        """The quantity at the full stroke as an item, with a bound that has no meaning."""
        return Item(quantity=self.quantity, case=self.case, output=self.output, at_least=0.0)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; values that equal their defaults are left out."""
        data: dict[str, Any] = {"quantity": self.quantity}
        for name, default in (("case", ""), ("output", ""), ("scale", 1.0)):
            if (value := getattr(self, name)) != default:
                data[name] = value
        return data


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A further load case of a problem: supports, input, outputs and loads of its own.

    Parameters
    ----------
    name
        Name of the case.
    supports, input
        As in `Problem`.
    outputs
        Outputs by name.
    loads
        Forces, springs and own weight.
    """

    name: str
    supports: Supports
    input: Input
    outputs: Mapping[str, Output]
    loads: Loads = field(default_factory=Loads)

    def __post_init__(self) -> None:
        object.__setattr__(self, "outputs", dict(self.outputs))
        if not self.outputs:
            raise InvalidProblem(f"case {self.name!r}: expected at least one output")

    __reduce__ = rebuild


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Specification:
    """Load cases of a problem, items that a design must meet, and the objective.

    Parameters
    ----------
    case, output
        Names of the load case that the problem itself describes, and of its output.
    outputs
        Further outputs of that case, by name.
    cases
        Further load cases on the same lattice.
    items
        What a design must meet.
    maximise
        Objectives; the smallest one in units of its scale counts. Without one, the smallest
        margin of an item is maximised.
    weight : (d,) float64
        Own weight, a force on a unit of volume, for `sag`; None if it is not bounded.
    symmetry
        ``"x"``, ``"y"`` or in space ``"z"`` for designs that equal their mirror image along this
        axis; in space also ``"2-fold"``, ``"3-fold"``, ``"4-fold"`` or ``"6-fold"`` for those that
        a part of a turn about the vertical axis does not change.
    domain : sequence of (k, 2) or (k, 3, 3) float64
        Closed rings around the region of the plane in which struts must lie, lattice units; in
        space triangles of closed surfaces. A point is inside if a ray from it crosses them an odd
        number of times. None by default.
    tolerances
        Deviations over which the items are to be met; None if only as drawn.

    Raises
    ------
    InvalidProblem
        If names are repeated, or an item names an unknown case or output.

    Examples
    --------
    >>> specification = Specification(
    ...     items=[Item(quantity="off_axis", case="case", output="output", at_most=0.1)],
    ...     maximise=[ObjectiveTerm(quantity="gain", case="case", output="output")],
    ... )
    >>> specification.case_names, specification.items[0].at_most
    (('case',), 0.1)
    """

    case: str = "case"
    output: str = "output"
    outputs: Mapping[str, Output] = field(default_factory=dict)
    cases: tuple[Case, ...] = ()
    items: tuple[Item, ...] = ()
    maximise: tuple[ObjectiveTerm, ...] = ()
    weight: NDArray[np.float64] | None = None
    symmetry: tuple[str, ...] = ()
    domain: tuple[NDArray[np.float64], ...] = ()
    tolerances: Tolerances | None = None

    def __post_init__(self) -> None:
        for name in ("cases", "items", "maximise", "symmetry"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        object.__setattr__(self, "outputs", dict(self.outputs))
        if self.weight is not None:
            object.__setattr__(self, "weight", locked(real_array("weight", self.weight)))
        domain = tuple(locked(real_array("domain", each)) for each in self.domain)
        if any(each.shape[1:] not in {(2,), (3, 3)} or len(each) < 3 for each in domain):
            raise InvalidProblem(
                "domain: expected rings of at least 3 points [x, y], or closed surfaces of "
                "triangles with corners [x, y, z]"
            )
        object.__setattr__(self, "domain", domain)
        if len(set(self.case_names)) < len(self.case_names):
            raise InvalidProblem(f"cases: names must differ, got {', '.join(self.case_names)}")
        if self.output in self.outputs:
            raise InvalidProblem(f"outputs: the name {self.output!r} is given twice")
        for name in self.symmetry:
            if name not in SYMMETRIES:
                raise InvalidProblem(
                    f"symmetry: expected one of {', '.join(SYMMETRIES)}, got {name!r}"
                )
        for item in self.items:
            self._check(item)
        for objective in self.maximise:
            self._check(objective)

    __reduce__ = rebuild

    def _check(self, each: Item | ObjectiveTerm) -> None:
        """Check that an item names a case and an output where its quantity belongs to one."""
        scope = QUANTITIES[each.quantity].scope
        if scope == "design":
            return
        if each.case not in self.case_names:
            raise InvalidProblem(
                f"items: {each.quantity}: unknown case {each.case!r}; known: "
                f"{', '.join(self.case_names)}"
            )
        known = self.output_names(each.case)
        if scope == "output" and each.output not in known:
            raise InvalidProblem(
                f"items: {each.quantity}: case {each.case!r} has no output {each.output!r}; "
                f"known: {', '.join(known)}"
            )

    @property
    def case_names(self) -> tuple[str, ...]:
        """Names of all load cases, that of the problem itself first."""
        return (self.case, *(each.name for each in self.cases))

    def output_names(self, case: str) -> tuple[str, ...]:
        """Return the names of the outputs of a case."""
        if case == self.case:
            return (self.output, *self.outputs)
        return tuple(next(each.outputs for each in self.cases if each.name == case))
