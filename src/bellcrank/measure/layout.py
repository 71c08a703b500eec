"""Markers for filming a part: their identifiers, positions and sizes."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.model import require_plane

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.part import Part

SCHEMA = "bellcrank/markers/1"
DICTIONARY = "DICT_4X4_50"
"""Dictionary of OpenCV from which the markers are taken."""
MODULES = 6
"""Number of modules along a side of a marker, black border included."""
ROLES = {"reference": range(24), "support": range(24, 30), "input": range(30, 38),
         "output": range(38, 50)}  # fmt: skip
"""Identifiers of the markers of each role."""
SIZE, REFERENCE_SIZE = 12.0, 15.0
"""Default side of the markers on the part and on the sheet, mm."""
SPACING = 45.0
"""Smallest distance of neighbouring markers of the sheet, mm."""
SUPPORTS = 3
"""Largest number of markers on the supports."""
EDGE = 7.0
"""Margin of the page that printers cannot reach, mm."""
PAGES = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0),
         "A0": (1189.0, 841.0)}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Marker:
    """A square marker.

    Parameters
    ----------
    id
        Number in the dictionary, which encodes the role (`ROLES`).
    role
        ``"reference"`` on the sheet, ``"support"``, ``"input"`` or ``"output"`` on the part.
    centre : (2,) float64, mm
        Centre, in the coordinates of the part at rest.
    size
        Side of the black square, mm.
    nodes : (n,) int64
        Nodes that move with the marker as a rigid body; none for reference markers.
    """

    id: int
    role: str
    centre: NDArray[np.float64]
    size: float
    nodes: NDArray[np.int64]

    @property
    def corners(self) -> NDArray[np.float64]:
        """Corners (4, 2), mm, in the order of OpenCV: clockwise from the upper left."""
        half = 0.5 * self.size
        return self.centre + half * np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class MarkerLayout:
    """All markers of a part, and the page of the reference markers.

    Parameters
    ----------
    markers
        The markers.
    page
        Name of the paper size.
    corner : (2,) float64, mm
        Lower left corner of the page in the coordinates of the part at rest.
    extent : (2,) float64, mm
        Width and height of the page.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec
    >>> part = PartSpec().of(human_design("crane"))
    >>> layout = marker_layout(part, part.positions[None])
    >>> [(marker.id, marker.role) for marker in layout.on_part]
    [(24, 'support'), (25, 'support'), (26, 'support'), (30, 'input'), (38, 'output')]
    >>> layout.page, len(layout.reference)
    ('A4', 10)
    """

    markers: tuple[Marker, ...]
    page: str
    corner: NDArray[np.float64]
    extent: NDArray[np.float64]

    @property
    def reference(self) -> tuple[Marker, ...]:
        """Markers on the sheet."""
        return self.of_role("reference")

    @property
    def on_part(self) -> tuple[Marker, ...]:
        """Markers on the part."""
        return tuple(marker for marker in self.markers if marker.role != "reference")

    def of_role(self, role: str) -> tuple[Marker, ...]:
        """Return the markers of a role."""
        return tuple(marker for marker in self.markers if marker.role == role)

    @property
    def frame_size(self) -> tuple[float, float]:
        """Width and height over the outer edges of the reference markers, mm."""
        corners = np.concatenate([marker.corners for marker in self.reference])
        wide, high = np.ptp(corners, axis=0).tolist()
        return wide, high

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; lengths in mm."""
        return {
            "schema": SCHEMA, "dictionary": DICTIONARY, "page": self.page,
            "corner_mm": self.corner.tolist(), "extent_mm": self.extent.tolist(),
            "markers": [
                {"id": each.id, "role": each.role, "centre_mm": each.centre.tolist(),
                 "size_mm": each.size, "nodes": each.nodes.tolist()}
                for each in self.markers
            ],
        }  # fmt: skip

    @staticmethod
    def from_dict(data: Mapping[str, Any], source: str = "markers") -> MarkerLayout:
        """Return the layout of plain data.

        Raises
        ------
        InvalidFile
            If it does not follow the schema.
        """
        if data.get("schema") != SCHEMA or data.get("dictionary") != DICTIONARY:
            raise InvalidFile(
                f"{source}: expected schema {SCHEMA!r} with markers of {DICTIONARY}, got "
                f"{data.get('schema')!r} with {data.get('dictionary')!r}"
            )
        try:
            markers = tuple(
                Marker(
                    int(each["id"]), str(each["role"]),
                    np.array(each["centre_mm"], dtype=np.float64).reshape(2),
                    float(each["size_mm"]), np.array(each["nodes"], dtype=np.int64),
                )
                for each in data["markers"]
            )  # fmt: skip
            corner, extent = (
                np.array(data[key], dtype=np.float64).reshape(2)
                for key in ("corner_mm", "extent_mm")
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InvalidFile(f"{source}: not a list of markers ({error!r})") from error
        for marker in markers:
            if marker.id not in ROLES.get(marker.role, ()) or not 0.0 < marker.size < math.inf:
                raise InvalidFile(
                    f"{source}: marker {marker.id} of role {marker.role!r} and size "
                    f"{marker.size!r} mm; expected roles and numbers as written by export --markers"
                )
        return MarkerLayout(markers, str(data.get("page")), corner, extent)


def read_layout(path: Path) -> MarkerLayout:
    """Return the layout of a file that `export --markers` wrote.

    Raises
    ------
    InvalidFile
        If it cannot be read or does not follow the schema.
    """
    try:
        data = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidFile(f"{path}: cannot be read ({error})") from error
    if not isinstance(data, dict):
        raise InvalidFile(f"{path}: expected a table of markers")
    return MarkerLayout.from_dict(data, str(path))


def marker_layout(
    part: Part,
    swept: NDArray[np.float64],
    size: float = SIZE,
    reference_size: float = REFERENCE_SIZE,
) -> MarkerLayout:
    """Return markers for a part: on its supports, input and output, and around it on a sheet.

    One marker is at the mean position of each connected block of input and of output nodes; its
    motion as a rigid body gives that of the nodes of the block. Up to three are on supported
    nodes far from each other. The reference markers are in a rectangle around all positions
    of the part; their page is the smallest of A4 to A0 that holds them.

    Parameters
    ----------
    part
        Part in the plane.
    swept : (K, N, 2) float64, mm
        Positions of the nodes along the stroke.
    size, reference_size
        Side of the markers on the part and on the sheet, mm.

    Raises
    ------
    InvalidProblem
        If the part is in space.
    InvalidSettings
        If a size is not valid, there are more blocks than markers, or no page is large enough.
    """
    problem = part.design.problem
    require_plane(problem, "markers")
    check_size("marker size", size)
    check_size("reference size", reference_size)
    markers: list[Marker] = []
    for role, region in (("input", problem.input.nodes), ("output", problem.output.nodes)):
        blocks = node_blocks(part, region)
        if len(blocks) > len(ROLES[role]):
            raise InvalidSettings(
                f"{role}: {len(blocks)} separate blocks of nodes; there are markers for at most "
                f"{len(ROLES[role])}"
            )
        for number, nodes in zip(ROLES[role], blocks, strict=False):
            markers.append(Marker(number, role, part.positions[nodes].mean(axis=0), size, nodes))
    markers += _support_markers(part, markers, size)
    markers.sort(key=lambda marker: marker.id)
    reach = _card(size)
    used = np.unique(part.struts)
    low = swept[:, used].min(axis=(0, 1)) - 0.5 * part.section.width
    high = swept[:, used].max(axis=(0, 1)) + 0.5 * part.section.width
    for marker in markers:
        if len(marker.nodes):
            moved = swept[:, marker.nodes].mean(axis=1)
            low = np.minimum(low, moved.min(axis=0) - 0.5 * math.sqrt(2.0) * reach)
            high = np.maximum(high, moved.max(axis=0) + 0.5 * math.sqrt(2.0) * reach)
    offset = 0.5 * _card(reference_size) + 1.0
    references = _around(low - offset, high + offset, reference_size)
    corners = np.concatenate([marker.corners for marker in references])
    first, last = corners.min(axis=0), corners.max(axis=0)
    page, extent = _page_for(last - first)
    corner = 0.5 * (first + last) - 0.5 * extent
    return MarkerLayout((*references, *markers), page, corner, extent)


def check_size(name: str, side: float) -> None:
    """Check the side of markers, mm.

    Raises
    ------
    InvalidSettings
        If it is not between 4 and 100 mm.
    """
    if not 4.0 <= side <= 100.0:
        raise InvalidSettings(f"{name}: expected a side of 4 to 100 mm, got {side!r} mm")


def node_blocks(part: Part, region: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the nodes of a region that have struts, in blocks connected by struts between them.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec
    >>> part = PartSpec().of(human_design("crane"))
    >>> [len(block) for block in node_blocks(part, part.design.problem.input.nodes)]
    [10]
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    nodes = np.intersect1d(region, part.struts)
    if not len(nodes):
        raise InvalidSettings("markers: no strut touches the input or the output")
    inner = part.struts[np.isin(part.struts, nodes).all(axis=1)]
    pairs = np.searchsorted(nodes, inner)
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(nodes), len(nodes)))
    count, label = connected_components(graph, directed=False)
    return [nodes[label == k] for k in range(count)]


def _card(size: float) -> float:
    """Return the side of a marker with a white margin of one module, mm."""
    return size * (MODULES + 2) / MODULES


def _support_markers(part: Part, others: list[Marker], size: float) -> list[Marker]:
    """Return markers on supported nodes, far from each other and from other markers."""
    fixed = np.intersect1d(part.design.problem.supports.fixed, part.struts)
    if not len(fixed):
        return []
    points, card = part.positions[fixed], _card(size)
    # Each candidate covers the supported nodes near one of them, to lie inside the plate.
    near = np.linalg.norm(points[:, None] - points, axis=2) < card
    centres = np.stack([points[row].mean(axis=0) for row in near])
    taken = np.array([marker.centre for marker in others])
    free = np.linalg.norm(centres[:, None] - taken, axis=2).min(axis=1) > 1.5 * card
    near, centres = near[free], centres[free]
    if not len(centres):
        return []
    chosen = [int(np.argmin(centres @ np.array([1.0, 0.01])))]
    while len(chosen) < min(SUPPORTS, len(centres)):
        away = np.linalg.norm(centres[:, None] - centres[chosen], axis=2).min(axis=1)
        if away.max() < 1.2 * card:
            break
        chosen.append(int(np.argmax(away)))
    return [
        Marker(number, "support", centres[k], size, fixed[near[k]])
        for number, k in zip(ROLES["support"], chosen, strict=False)
    ]


def _around(low: NDArray[np.float64], high: NDArray[np.float64], size: float) -> list[Marker]:
    """Return reference markers with their centres on a rectangle, corners included."""
    wide, high_ = (high - low).tolist()
    step = max(SPACING, 1.5 * size, 2.0 * (wide + high_) / (len(ROLES["reference"]) - 4))
    across, up = (max(1, math.floor(side / step)) for side in (wide, high_))
    x, y = np.linspace(low[0], high[0], across + 1), np.linspace(low[1], high[1], up + 1)
    centres = [(each, end) for end in (low[1], high[1]) for each in x.tolist()]
    centres += [(end, each) for each in y[1:-1].tolist() for end in (low[0], high[0])]
    nodes = np.empty(0, dtype=np.int64)
    return [
        Marker(number, "reference", np.array(centre), size, nodes)
        for number, centre in zip(ROLES["reference"], centres, strict=False)
    ]


def _page_for(wanted: NDArray[np.float64]) -> tuple[str, NDArray[np.float64]]:
    for name, (long, short) in PAGES.items():
        for extent in (np.array([long, short]), np.array([short, long])):
            if (wanted + 2.0 * EDGE <= extent).all():
                return name, extent
    raise InvalidSettings(
        f"markers: no page up to A0 holds reference markers over {wanted[0]:.0f} x "
        f"{wanted[1]:.0f} mm; film a smaller part"
    )
