"""What a printer can make of a part, and what not: a registry of checks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.export.beads import PrintRules
from bellcrank.export.formats.base import Export
from bellcrank.export.solid import whole_layers
from bellcrank.part.outline.room import find_joins
from bellcrank.part.outline.struts import read_struts
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.part import Part
    from bellcrank.part.outline import Outline

    Places = tuple[tuple[float, float], ...]

NEARLY = 0.1
"""By how much of a bead struts may differ from a whole number of lines."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that a printer will not make as it is drawn, or that serves no purpose.

    Parameters
    ----------
    kind
        Name of the check.
    sentence
        What was found, and what to do.
    places : tuple of (x, y), mm
        Where, the worst first; empty where it is the same everywhere.
    """

    kind: str
    sentence: str
    places: Places = ()


checks: Registry[Callable[[Part, Outline, PrintRules], Finding | None]] = Registry("print check")
"""From a part, its outline and what a printer lays down, to what there is to say, if anything."""


def check_print(what: Part | Export, rules: PrintRules | None = None) -> list[Finding]:
    """Return what is to be said about printing a part.

    Parameters
    ----------
    what
        A part, or one with a changed outline.
    rules
        What the printer lays down.

    Raises
    ------
    InvalidSettings
        If there can be no such part, or it is thinner than one layer.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec
    >>> part = PartSpec(width=1.6).of(human_design("crane"))
    >>> [finding.kind for finding in check_print(part, PrintRules(layer=0.2, bead_width=0.4))]
    ['struts', 'dead-ends']
    """
    rules = rules or PrintRules()
    bundle = what if isinstance(what, Export) else Export(part=what)
    outline = bundle.outline()
    found = [check(bundle.part, outline, rules) for check in checks.values()]
    return [finding for finding in found if finding is not None]


@checks.register("struts")
def check_struts(part: Part, outline: Outline, rules: PrintRules) -> Finding | None:  # noqa: ARG001
    """Find struts that are too few lines wide, or no whole number of them."""
    width = part.section.width
    lines, least = rules.lines_in(width), rules.width_of(rules.least_lines)
    short = NEARLY * rules.bead_width
    bead = f"{rules.bead_width:g} mm beads in {rules.layer:g} mm layers"
    if width < least - short:
        return Finding(
            "struts",
            f"Struts {width:g} mm wide hold fewer than {_counted(rules.least_lines, 'line')} of "
            f"{bead}; make them at least {least:.2f} mm wide, or choose a finer nozzle.",
        )
    off = width - rules.width_of(lines)
    if abs(off) <= short:
        return None
    below = lines if off > 0.0 else lines - 1
    fitting = " or ".join(f"{rules.width_of(n):.2f}" for n in (below, below + 1) if n > 0)
    bead_width = (width - rules.overlap) / lines + rules.overlap
    return Finding(
        "struts",
        f"Struts {width:g} mm wide are no whole number of {bead}: {fitting} mm would be, and so "
        f"would {lines} beads of {bead_width:.2f} mm.",
    )


@checks.register("layers")
def check_layers(part: Part, outline: Outline, rules: PrintRules) -> Finding | None:  # noqa: ARG001
    """Find a thickness that is no whole number of layers."""
    wanted = part.section.thickness
    printed = whole_layers(wanted, rules.layer)
    if abs(printed - wanted) <= 1e-6 * wanted:
        return None
    return Finding(
        "layers",
        f"A thickness of {wanted:g} mm is no whole number of layers of {rules.layer:g} mm; "
        f"{round(printed / rules.layer)} of them are {printed:g} mm.",
    )


@checks.register("gaps")
def check_gaps(part: Part, outline: Outline, rules: PrintRules) -> Finding | None:
    """Find places where struts that share no node come closer than a printer can keep them."""
    import shapely

    least, half = _smallest_gap(rules), 0.5 * part.section.width
    struts = read_struts(part.positions, part.struts)
    joins = find_joins(struts, half, half + 0.5 * least)
    width = 2.0 * (joins.bottlenecks - half)
    # Within plates there are no gaps any more.
    solid = outline.polygon()
    shapely.prepare(solid)
    open_ = (width < least) & ~shapely.contains_xy(solid, *joins.places.T)
    if not open_.any():
        return None
    return Finding(
        "gaps",
        f"{_counted(int(open_.sum()), 'gap')} between struts that share no node, narrower than "
        f"{least:g} mm, may close in print; the narrowest is {width[open_][0]:.2g} mm "
        f"at {_place(joins.places[open_][0])}. Choose narrower struts or a larger scale.",
        _places(joins.places[open_]),
    )


@checks.register("holes")
def check_holes(part: Part, outline: Outline, rules: PrintRules) -> Finding | None:  # noqa: ARG001
    """Find holes in which no circle as wide as a bead fits."""
    import shapely

    if not outline.holes:
        return None
    least = _smallest_gap(rules)
    rings = np.array([shapely.Polygon(loop.flattened(0.01 * least)) for loop in outline.holes])
    # A circle with the radius area / length fits into any hole.
    small = np.flatnonzero(shapely.area(rings) < 0.5 * least * shapely.length(rings))
    circles = shapely.maximum_inscribed_circle(rings[small], 0.01 * least)
    across = 2.0 * shapely.length(circles)
    narrow = across < least
    if not narrow.any():
        return None
    order = np.argsort(across[narrow], kind="stable")
    places = shapely.get_coordinates(shapely.get_point(circles[narrow][order], 0))
    return Finding(
        "holes",
        f"{_counted(int(narrow.sum()), 'hole')} less than {least:g} mm across may close in "
        f"print; the smallest is {across[narrow].min():.2g} mm at {_place(places[0])}. Choose "
        "narrower struts or a larger scale.",
        _places(places),
    )


@checks.register("fillets")
def check_fillets(part: Part, outline: Outline, rules: PrintRules) -> Finding | None:  # noqa: ARG001
    """Find fillets that are smaller than half a bead."""
    radius, least = part.fillet_radius, 0.5 * rules.bead_width
    if radius >= least:
        return None
    return Finding(
        "fillets",
        f"Fillets of {radius:.3g} mm are smaller than half a bead ({least:.3g} mm): corners come "
        "out rounder than they are drawn and computed; choose larger ones.",
    )


@checks.register("pieces")
def check_pieces(part: Part, outline: Outline, rules: PrintRules) -> Finding | None:  # noqa: ARG001
    """Find separate pieces."""
    if outline.piece_count == 1:
        return None
    loose = sorted(outline.outer, key=lambda loop: loop.area)[:-1]
    places = np.array([loop.points[0] for loop in loose])
    return Finding(
        "pieces",
        f"The part is in {outline.piece_count} pieces that do not hang together, the smallest "
        f"at {_place(places[0])}; leave out what is loose.",
        _places(places),
    )


@checks.register("dead-ends")
def check_dead_ends(part: Part, outline: Outline, rules: PrintRules) -> Finding | None:  # noqa: ARG001
    """Find struts that end in a node that nothing holds, drives or observes."""
    problem = part.design.problem
    degree = np.bincount(part.struts.ravel(), minlength=problem.lattice.node_count)
    used = np.concatenate([problem.supports.nodes, problem.input.nodes, problem.output.nodes])
    ends = np.setdiff1d(np.flatnonzero(degree == 1), used)
    if not len(ends):
        return None
    end, carry = ("ends", "carries") if len(ends) == 1 else ("end", "carry")
    return Finding(
        "dead-ends",
        f"{_counted(len(ends), 'strut')} {end} in a free node and {carry} no load, the first in "
        f"node {ends[0]} at {_place(part.positions[ends[0]])}; stripping saves material.",
        _places(part.positions[ends]),
    )


def _smallest_gap(rules: PrintRules) -> float:
    """Return how far apart surfaces must be to stay so, mm."""
    return max(rules.nozzle, rules.bead_width)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _place(place: NDArray[np.float64]) -> str:
    return f"({place[0]:.4g}, {place[1]:.4g}) mm"


def _places(places: NDArray[np.float64]) -> Places:
    return tuple((x, y) for x, y in places.tolist())
