"""Small SVG drawings of designs, at rest and moved.

Coordinates are integers, with 20 units per lattice spacing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.plots.scene import (
    arrow_length,
    beam_kinds,
    input_arrows,
    output_arrows,
    spacing,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bellcrank.model import Design
    from bellcrank.plots.scene import Arrow

UNITS = 20
"""Drawing units per lattice spacing."""
HEAD = 11.0
"""Length of an arrowhead in drawing units."""
STYLE = """
svg{--rest:#d5dae0;--ink:#20262d;--in:#d55e00;--out:#0072b2;--ground:#c3c9d0;--back:#fff}
@media(prefers-color-scheme:dark){svg{--rest:#3a424b;--ink:#e3e8ee;--in:#ff9352;--out:#63b7f2;\
--ground:#4c555f;\
--back:#0d1117}}
path{fill:none;stroke-linecap:round;stroke-linejoin:round;stroke-width:4.2}
.r{stroke:var(--rest)}.m{stroke:var(--ink)}.i{stroke:var(--in)}.o{stroke:var(--out)}
.g{stroke:var(--ground);stroke-width:13}
.a{stroke-width:5}.h{stroke:var(--back);stroke-width:9}"""


@dataclass(frozen=True, slots=True)
class Thumbnail:
    """Paths of a drawing.

    Parameters
    ----------
    view_box
        View box of the SVG.
    rest, moved
        Paths of the loaded beams: ``"m"`` of the structure, ``"i"`` of the input, ``"o"`` of the
        output.
    ground
        Path along each row of supports.
    arrows
        Arrows in the input direction, ``"i"``, and in the output direction, ``"o"``.
    """

    view_box: str
    rest: dict[str, str]
    moved: dict[str, str]
    ground: str
    arrows: dict[str, str]

    def svg(self, label: str) -> str:
        """Return an SVG file, in the light or dark colours that the reader prefers."""
        paths = [("g", self.ground), ("r", "".join(self.rest.values())), *self.moved.items()]
        paths += [
            (f"{shade} a", path) for name, path in self.arrows.items() for shade in ("h", name)
        ]
        content = "".join(f'<path class="{name}" d="{path}"/>' for name, path in paths)
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{self.view_box}" role="img" '
            f'aria-label="{label}"><style>{STYLE}</style>{content}</svg>\n'
        )


def thumbnail(design: Design, displacement: NDArray[np.float64]) -> Thumbnail:
    """Draw a design at rest and moved.

    Parameters
    ----------
    design
        Design to draw.
    displacement : (N, 2)
        Displacement of its nodes, drawn to scale; nan counts as zero.

    Examples
    --------
    >>> from bellcrank.machines import elementary
    >>> design = elementary(7, "up").full_design()
    >>> drawn = thumbnail(design, np.zeros((design.problem.lattice.node_count, 2)))
    >>> drawn.view_box.split()[:2], len(drawn.moved), drawn.moved == drawn.rest
    (['-88', '-168'], 3, True)
    """
    problem = design.problem
    scale = UNITS / spacing(problem)
    flip = np.array([scale, -scale])
    rest = (problem.lattice.positions * flip).round().astype(np.int64)
    places = problem.lattice.positions + np.nan_to_num(displacement)
    moved = (places * flip).round().astype(np.int64)
    kinds = beam_kinds(design)
    ends = problem.lattice.beams[kinds.load_bearing]
    of_input = np.isin(ends, problem.input.nodes).all(axis=1)
    of_output = np.isin(ends, problem.output.nodes).all(axis=1)
    groups = {"m": ends[~of_input & ~of_output], "i": ends[of_input], "o": ends[of_output]}
    arrows = {"i": input_arrows(problem), "o": output_arrows(problem, places)}
    tips = np.array([point for each in arrows.values() for a in each for point in (a.tail, a.tip)])
    # Space for an arrow in any direction gives drawings of one lattice size the same scale.
    room = int(scale * arrow_length(problem)) + np.array([UNITS // 2, 0])
    sides = [rest.min(axis=0) - room, rest.max(axis=0) + np.array([UNITS // 2, 0])]
    corners = np.concatenate([rest, moved, (tips * flip).round().astype(np.int64), sides])
    low, high = corners.min(axis=0) - 8, corners.max(axis=0) + 10
    return Thumbnail(
        view_box=f"{low[0]} {low[1]} {high[0] - low[0]} {high[1] - low[1]}",
        rest={name: _path(rest[pairs]) for name, pairs in groups.items()},
        moved={name: _path(moved[pairs]) for name, pairs in groups.items()},
        ground=_path(rest[problem.lattice.beams[kinds.ground]]),
        arrows={
            name: "".join(_arrow(each, flip) for each in several)
            for name, several in arrows.items()
        },
    )


def _path(segments: Iterable[NDArray[np.int64]]) -> str:
    """Return lines (n, 2, 2) as one path."""
    return "".join(f"M{x0} {y0}L{x1} {y1}" for (x0, y0), (x1, y1) in np.asarray(segments).tolist())


def _arrow(arrow: Arrow, flip: NDArray[np.float64]) -> str:
    """Return the path of an arrow."""
    tail, tip = np.array(arrow.tail) * flip, np.array(arrow.tip) * flip
    along = (tip - tail) / max(float(np.hypot(*(tip - tail))), 1e-9)
    across = np.array([-along[1], along[0]])
    left, right = (tip - HEAD * along + side * 0.7 * HEAD * across for side in (1.0, -1.0))
    (a, b), (c, d), (e, f), (g, h) = (
        point.round().astype(int).tolist() for point in (tail, tip, left, right)
    )
    return f"M{a} {b}L{c} {d}M{e} {f}L{c} {d}L{g} {h}"
