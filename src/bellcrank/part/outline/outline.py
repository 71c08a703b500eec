"""The outline of a part that consists of struts."""

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
    width: float,
    fillet: float,
    *,
    keep_holes: bool = True,
) -> Outline:
    """Return the outline of struts with round ends and filled corners.

    The part is the union of all points within half a width of the centre lines, with all
    corners between struts filled as far as a disc of radius `fillet` does not reach into
    them. Its lines and arcs are exact. Where `fillet` is above 0, they meet without kinks.

    Lines shorter than 1e-5 of the width are left out, and arcs likewise, which may move their
    neighbours' ends as far. Nodes within 1e-8 of the size of the whole are in one place, and
    holes narrower than 1e-5 of it do not count as such.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
        Nodes. Those that no beam touches are left out.
    beams : (M, 2) array_like of int
        The two nodes of each strut. Struts may cross, overlap and end anywhere.
    width : float, mm
        Width of the struts.
    fillet : float, mm
        Radius of the fillets; 0 leaves corners sharp.
    keep_holes
        Whether to refuse struts so wide that holes between them close, or that they touch
        where no node joins them. If false, fillets too may close holes, but still not split
        them nor join struts.

    Returns
    -------
    Outline
        Outer loops counterclockwise, holes clockwise.

    Raises
    ------
    InvalidSettings
        If an array or a length makes no sense, a beam has no length, or `width` or `fillet`
        is larger than the holes permit.

    Examples
    --------
    >>> outline = strut_outline([[0, 0], [10, 0]], [[0, 1]], width=2.0, fillet=0.5)
    >>> round(outline.area, 6), len(outline.outer[0].points)
    (23.141593, 4)
    """
    check_sizes(width, fillet)
    struts = read_struts(positions, beams)
    half, reach = 0.5 * width, 0.5 * width + fillet
    limits = find_limits(struts, reach) if keep_holes else find_joins(struts, half, reach)
    check_room(limits, width, fillet)
    return filled(struts, width, fillet)
