"""The planar outline of a part, which is meshed, printed and cut.

The outline of straight struts consists of exact lines and circular arcs, with fillets in all
corners between struts. All lengths are in mm.

Examples
--------
Three struts between the corners of an equilateral triangle:

>>> positions = [[0.0, 0.0], [12.0, 0.0], [6.0, 108.0**0.5]]
>>> beams = [[0, 1], [1, 2], [2, 0]]
>>> expected_holes(positions, beams)
1
>>> round(room_for_fillet(positions, beams, width=2.0), 2)
2.46
>>> outline = strut_outline(positions, beams, width=2.0, fillet=0.5)
>>> outline.piece_count, outline.hole_count
(1, 1)

Its hole has three straight sides and three fillets, in clockwise order:

>>> hole = outline.holes[0]
>>> (hole.turns * 180.0 / 3.141592653589793).round(6).tolist()
[0.0, -120.0, 0.0, -120.0, 0.0, -120.0]
>>> hole.radii.round(6).tolist()
[inf, 0.5, inf, 0.5, inf, 0.5]

Polygons approximate it to any accuracy:

>>> round(outline.area, 3), round(outline.polygon(sagitta=1e-6).area, 3)
(70.459, 70.459)
"""

from bellcrank.part.outline.curves import Loop, Outline
from bellcrank.part.outline.outline import strut_outline
from bellcrank.part.outline.room import room_for_fillet
from bellcrank.part.outline.struts import expected_holes

__all__ = ["Loop", "Outline", "expected_holes", "room_for_fillet", "strut_outline"]
