"""The outline of a set of struts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.part.outline.fillets import filled
from bellcrank.part.outline.room import check_room, check_sizes, find_joins, find_limits
from bellcrank.part.outline.struts import read_struts

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from bellcrank.part.outline.curves import Outline


def strut_outline(
    positions: ArrayLike,
    beams: ArrayLike,
    width: ArrayLike,
    fillet: float,
    *,
    keep_holes: bool = True,
) -> Outline:
    """Return the outline of struts with round ends and filled corners.

    The part is the set of all points within half the width of a strut from its centre line. Corners
    between struts are filled where a disc of radius `fillet` does not reach. Lines and arcs are
    exact. They are tangent to each other if `fillet` is above 0.

    Lines and arcs shorter than 1e-5 of the width are left out, which moves the ends of their
    neighbours by at most this length. Nodes closer than 1e-8 of the size of the part coincide.
    Holes narrower than 1e-5 of it are ignored.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
        Nodes. Nodes without beams are ignored.
    beams : (M, 2) array_like of int
        The two nodes of each strut. Struts may cross and overlap.
    width : float or (M,) array_like, mm
        Strut width, one for all or one for each strut.
    fillet : float, mm
        Fillet radius; 0 for sharp corners.
    keep_holes
        Whether to refuse a width at which holes close or struts without a common node touch. If
        false, fillets may close holes as well, but may not split them or connect struts.

    Returns
    -------
    Outline
        Outer loops counterclockwise, holes clockwise.

    Raises
    ------
    InvalidSettings
        If an array or a length is not valid, a beam has no length, or `width` or `fillet` is too
        large for the holes.

    Examples
    --------
    >>> outline = strut_outline([[0, 0], [10, 0]], [[0, 1]], width=2.0, fillet=0.5)
    >>> round(outline.area, 6), len(outline.outer[0].points)
    (23.141593, 4)
    """
    narrowest = check_sizes(width, fillet)
    struts = read_struts(positions, beams, width)
    half, reach = 0.5 * narrowest, 0.5 * narrowest + fillet
    limits = find_limits(struts, reach) if keep_holes else find_joins(struts, half, reach)
    check_room(limits, narrowest, fillet)
    return filled(struts, narrowest, fillet)
