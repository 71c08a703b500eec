"""Files of the markers of a part: pages to print, and their positions."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from bellcrank.model.storage import write_bytes
from bellcrank.plots.marker_sheet import cards_figure, page_bytes, sheet_figure
from bellcrank.plots.protocol import Protocol, protocol_figure
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.workflows.measure import computed_motion, layout_for

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Design
    from bellcrank.part import PartSpec


def marker_files(out: Path) -> tuple[Path, Path, Path, Path]:
    """Return the files of the markers beside an exported part.

    Examples
    --------
    >>> from pathlib import Path
    >>> [path.name for path in marker_files(Path("crane.3mf"))]
    ['crane.markers.pdf', 'crane.markers.svg', 'crane.cards.svg', 'crane.markers.json']
    """
    names = ("markers.pdf", "markers.svg", "cards.svg", "markers.json")
    pages, sheet, cards, positions = (out.with_name(f"{out.stem}.{name}") for name in names)
    return pages, sheet, cards, positions


def write_protocol(
    design: Design, spec: PartSpec, name: str, path: Path, *, overwrite: bool = False
) -> None:
    """Write a page that describes how to film a part.

    Parameters
    ----------
    design, spec
        The design and its size.
    name
        Name by which commands find the design.
    path
        Output file; the suffix pdf, png or svg selects the format.
    overwrite
        Whether to replace the file.

    Raises
    ------
    InvalidProblem, InvalidSettings
        If the part is in space, has no stable motion, or the suffix is unknown.
    OutputExists, StorageError
        If the file exists or cannot be written.
    """
    check_target(path, overwrite=overwrite)
    computed = computed_motion(design, spec)
    protocol = Protocol(
        layout_for(computed), computed.part, computed.full_stroke,
        float(computed.motion.along[-1]), name,
    )  # fmt: skip
    save_figure(protocol_figure(protocol), path, overwrite=overwrite)


def write_markers(
    design: Design, spec: PartSpec, out: Path, size: float | None = None, *, overwrite: bool = False
) -> tuple[Path, ...]:
    """Write the markers of a part beside its exported file.

    The PDF has two pages at true size: the sheet of reference markers and the markers to cut
    out. The SVG files have one of them each. The JSON file has numbers, roles, positions and sizes.

    Parameters
    ----------
    design, spec
        The design and its size; its motion determines where the sheet has room for markers.
    out
        File of the exported part.
    size
        Side of the markers on the part, mm; 12 mm by default.
    overwrite
        Whether to replace existing files.

    Returns
    -------
    tuple of Path
        The files.

    Raises
    ------
    InvalidProblem, InvalidSettings
        If the part is in space, has no stable motion, or there is no room for its markers.
    OutputExists, StorageError
        If a file exists or cannot be written.
    """
    computed = computed_motion(design, spec)
    layout = layout_for(computed, size)
    sheet = sheet_figure(layout, computed.part, computed.positions)
    cards = cards_figure(layout, computed.part)
    contents = (
        page_bytes([sheet, cards], ".pdf"),
        page_bytes([sheet], ".svg"),
        page_bytes([cards], ".svg"),
        (json.dumps(layout.to_dict(), indent=1) + "\n").encode(),
    )
    paths = marker_files(out)
    for path, content in zip(paths, contents, strict=True):
        write_bytes(path, content, overwrite=overwrite)
    return paths
