"""Checks of a part before printing, in a registry."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.export.beads import PrintRules
from bellcrank.export.formats.base import Export
from bellcrank.export.solid import whole_layers
from bellcrank.part.outline.room import find_joins
from bellcrank.part.outline.struts import read_struts
from bellcrank.part.pieces import beam_pieces
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.part import Part
    from bellcrank.part.outline import Outline

    Points = tuple[tuple[float, ...], ...]

STEEP = 40.0
"""Angle from the horizontal, degrees, above which struts print without supports."""
WIDTH_TOLERANCE = 0.1
"""Tolerance of the width of struts, as a fraction of the width of a bead."""


@dataclass(frozen=True, slots=True)
class PrintWarning:
    """A feature of a part that a printer cannot reproduce, or that has no function.

    Parameters
    ----------
    kind
        Name of the check.
    sentence
        Description and recommendation.
    points : tuple of (x, y) or (x, y, z), mm
        Positions, the worst first; empty if the warning concerns the whole part.
    """

    kind: str
    sentence: str
    points: Points = ()


checks: Registry[Callable[[Part, Outline, PrintRules], PrintWarning | None]] = Registry(
    "print check"
)
"""Functions from a part, its outline and the print rules to a warning or None."""


checks_in_space: Registry[Callable[[Part, PrintRules], PrintWarning | None]] = Registry(
    "print check in space"
)
"""Functions from a part in space and the print rules to a warning or None."""


def check_print(what: Part | Export, rules: PrintRules | None = None) -> list[PrintWarning]:
    """Return the warnings of all checks of a part.

    Parameters
    ----------
    what
        A part, or a part with a changed outline.
    rules
        Cross-section of printed lines.

    Raises
    ------
    InvalidSettings
        If the part is not valid, or thinner than one layer.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec
    >>> part = PartSpec(width=1.6).of(human_design("crane"))
    >>> [warning.kind for warning in check_print(part, PrintRules(layer=0.2, bead_width=0.4))]
    ['struts', 'dead-ends']
    """
    rules = rules or PrintRules()
    bundle = what if isinstance(what, Export) else Export(part=what)
    warnings: list[PrintWarning | None]
    if bundle.part.dimension == 3:
        warnings = [check(bundle.part, rules) for check in checks_in_space.values()]
    else:
        outline = bundle.outline()
        warnings = [check(bundle.part, outline, rules) for check in checks.values()]
    return [warning for warning in warnings if warning is not None]


@checks.register("struts")
def check_struts(part: Part, outline: Outline, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check that struts consist of a whole number of lines, and of enough of them."""
    width = float(part.widths.min())
    lines, least = rules.lines_in(width), rules.width_of(rules.min_lines)
    short = WIDTH_TOLERANCE * rules.bead_width
    bead = f"{rules.bead_width:g} mm beads in {rules.layer:g} mm layers"
    if width < least - short:
        return PrintWarning(
            "struts",
            f"Struts {width:g} mm wide are narrower than {_counted(rules.min_lines, 'line')} of "
            f"{bead}; choose a width of at least {least:.2f} mm, or a smaller nozzle.",
        )
    off = width - rules.width_of(lines)
    if abs(off) <= short and part.widths.max() - width <= short:
        return None
    if part.widths.max() - width > short:
        return PrintWarning(
            "struts",
            f"Struts are {width:.2f} to {part.widths.max():.2f} mm wide, which are not all whole "
            f"numbers of {bead}; slice with lines of variable width.",
        )
    below = lines if off > 0.0 else lines - 1
    fitting = " or ".join(f"{rules.width_of(n):.2f}" for n in (below, below + 1) if n > 0)
    bead_width = (width - rules.overlap) / lines + rules.overlap
    return PrintWarning(
        "struts",
        f"Struts {width:g} mm wide are not a whole number of {bead}; choose {fitting} mm, or "
        f"{lines} beads of {bead_width:.2f} mm.",
    )


@checks.register("layers")
def check_layers(part: Part, outline: Outline, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check that the thickness is a whole number of layers."""
    wanted = part.section.thickness
    printed = whole_layers(wanted, rules.layer)
    if abs(printed - wanted) <= 1e-6 * wanted:
        return None
    return PrintWarning(
        "layers",
        f"The thickness of {wanted:g} mm is not a whole number of layers of {rules.layer:g} mm; "
        f"{round(printed / rules.layer)} layers are {printed:g} mm.",
    )


@checks.register("gaps")
def check_gaps(part: Part, outline: Outline, rules: PrintRules) -> PrintWarning | None:
    """Check that gaps between struts without a common node are wide enough to stay open."""
    import shapely

    least, half = _smallest_gap(rules), 0.5 * float(part.widths.min())
    struts = read_struts(part.positions, part.struts, part.widths)
    joins = find_joins(struts, half, half + 0.5 * least)
    width = 2.0 * (joins.bottlenecks - half)
    # Plates have no gaps.
    solid = outline.polygon()
    shapely.prepare(solid)
    open_ = (width < least) & ~shapely.contains_xy(solid, *joins.points.T)
    if not open_.any():
        return None
    return PrintWarning(
        "gaps",
        f"{_counted(int(open_.sum()), 'gap')} between struts that share no node, narrower than "
        f"{least:g} mm, may close in printing; the narrowest is {width[open_][0]:.2g} mm "
        f"at {_format(joins.points[open_][0])}. Choose narrower struts or a larger scale.",
        _points(joins.points[open_]),
    )


@checks.register("holes")
def check_holes(part: Part, outline: Outline, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check that a circle of the width of a bead fits into each hole."""
    import shapely

    if not outline.holes:
        return None
    least = _smallest_gap(rules)
    polygons = np.array([shapely.Polygon(loop.flattened(0.01 * least)) for loop in outline.holes])
    # A circle of the radius area / length fits into every hole.
    small = np.flatnonzero(shapely.area(polygons) < 0.5 * least * shapely.length(polygons))
    circles = shapely.maximum_inscribed_circle(polygons[small], 0.01 * least)
    across = 2.0 * shapely.length(circles)
    narrow = across < least
    if not narrow.any():
        return None
    order = np.argsort(across[narrow], kind="stable")
    points = shapely.get_coordinates(shapely.get_point(circles[narrow][order], 0))
    return PrintWarning(
        "holes",
        f"{_counted(int(narrow.sum()), 'hole')} less than {least:g} mm across may close in "
        f"printing; the smallest is {across[narrow].min():.2g} mm at {_format(points[0])}. Choose "
        "narrower struts or a larger scale.",
        _points(points),
    )


@checks.register("fillets")
def check_fillets(part: Part, outline: Outline, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check that fillets are not smaller than half a bead."""
    radius, least = part.fillet_radius, 0.5 * rules.bead_width
    if radius >= least:
        return None
    return PrintWarning(
        "fillets",
        f"Fillets of {radius:.3g} mm are smaller than half a bead ({least:.3g} mm): "
        "printed corners are rounder than computed; choose larger fillets.",
    )


@checks.register("pieces")
def check_pieces(part: Part, outline: Outline, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check that the part is one piece."""
    if outline.piece_count == 1:
        return None
    loose = sorted(outline.outer, key=lambda loop: loop.area)[:-1]
    return _loose_pieces(outline.piece_count, np.array([loop.points[0] for loop in loose]))


@checks.register("dead-ends")
def check_dead_ends(part: Part, outline: Outline, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check for struts that end in a free node."""
    return check_free_ends(part, rules)


@checks_in_space.register("dead-ends")
def check_free_ends(part: Part, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check for struts that end in a free node."""
    problem = part.design.problem
    degree = np.bincount(part.struts.ravel(), minlength=problem.lattice.node_count)
    used = np.concatenate([problem.supports.nodes, problem.input.nodes, problem.output.nodes])
    ends = np.setdiff1d(np.flatnonzero(degree == 1), used)
    if not len(ends):
        return None
    end, carry = ("ends", "carries") if len(ends) == 1 else ("end", "carry")
    return PrintWarning(
        "dead-ends",
        f"{_counted(len(ends), 'strut')} {end} in a free node and {carry} no load, the first in "
        f"node {ends[0]} at {_format(part.positions[ends[0]])}; removing them saves material.",
        _points(part.positions[ends]),
    )


@checks_in_space.register("struts")
def check_diameters(part: Part, rules: PrintRules) -> PrintWarning | None:
    """Check that struts consist of enough lines."""
    diameter, least = float(part.widths.min()), rules.width_of(rules.min_lines)
    if diameter >= least - WIDTH_TOLERANCE * rules.bead_width:
        return None
    return PrintWarning(
        "struts",
        f"Struts of {diameter:g} mm are thinner than {_counted(rules.min_lines, 'line')} of "
        f"{rules.bead_width:g} mm; choose a diameter of at least {least:.2f} mm, or a smaller "
        "nozzle.",
    )


@checks_in_space.register("overhangs")
def check_overhangs(part: Part, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check for struts that are too flat to be printed without supports."""
    first, second = part.positions[part.struts].transpose(1, 0, 2)
    across, height = np.hypot(*(second - first)[:, :2].T), np.abs(second - first)[:, 2]
    # Struts on the bed are supported.
    above = np.minimum(first, second)[:, 2] > part.positions[part.struts][..., 2].min() + 1e-6
    flat = np.flatnonzero(above & (height < math.tan(math.radians(STEEP)) * across))
    if not len(flat):
        return None
    longest = flat[np.argsort(-across[flat], kind="stable")]
    points = 0.5 * (first + second)[longest]
    return PrintWarning(
        "overhangs",
        f"{_counted(len(flat), 'strut')} flatter than {STEEP:g} degrees, the longest "
        f"{across[longest[0]]:.3g} mm across at {_format(points[0])}, need supports, unless the "
        "printer bridges this length; a process with powder or resin needs none.",
        _points(points),
    )


@checks_in_space.register("pieces")
def check_connected(part: Part, rules: PrintRules) -> PrintWarning | None:  # noqa: ARG001
    """Check that the part is one piece."""
    piece = beam_pieces(part.design)
    sizes = np.bincount(piece)
    if len(sizes) == 1:
        return None
    loose = np.argsort(sizes, kind="stable")[:-1]
    return _loose_pieces(
        len(sizes), np.array([part.positions[part.struts[piece == each][0, 0]] for each in loose])
    )


def _loose_pieces(count: int, points: NDArray[np.float64]) -> PrintWarning:
    """Return the warning of a part in several pieces, with a point of each loose one."""
    return PrintWarning(
        "pieces",
        f"The part is in {count} pieces, the smallest at {_format(points[0])}; remove loose "
        "pieces.",
        _points(points),
    )


def _smallest_gap(rules: PrintRules) -> float:
    """Return the smallest gap that stays open, mm."""
    return max(rules.nozzle, rules.bead_width)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _format(point: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{each:.4g}' for each in point)}) mm"


def _points(points: NDArray[np.float64]) -> Points:
    return tuple(map(tuple, points.tolist()))
