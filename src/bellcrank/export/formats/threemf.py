"""3MF: a named object in mm, of triangles for slicers, or of beams.

The first format uses the core specification alone, since many slicers do not open the beam-lattice
extension (3MF Consortium, version 1.2), which the second one uses.
"""

from __future__ import annotations

import zipfile
from io import BytesIO
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.export.solid import Solid

_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_TYPES = (
    _HEAD + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>\n"
)
_RELATIONS = (
    _HEAD + '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="rel0" Target="/3D/3dmodel.model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "</Relationships>\n"
)
_BEAMS = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
SHORTEST = "0.0001"
"""Length below which a reader may leave out a beam, mm: none is."""
_DATE = (1980, 1, 1, 0, 0, 0)
"""Date in the archive, constant so that files of equal parts are equal."""


def to_bytes(export: Export) -> bytes:
    """Return the part as a 3MF file."""
    return solid_to_bytes(export.solid(), export.name)


def solid_to_bytes(solid: Solid, name: str) -> bytes:
    """Return a closed surface as a 3MF file with one object."""
    triangles = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in solid.triangles.tolist()
    )
    mesh = f"{_vertices(solid.vertices)}<triangles>\n{triangles}</triangles>\n"
    return _archive(_model(mesh, name))


def beams_to_bytes(export: Export) -> bytes:
    """Return a part in space as a 3MF file with one object of beams with spherical ends.

    The lowest corner of the part is at the origin, as in the file of triangles.

    Raises
    ------
    InvalidSettings
        If the part is in the plane, where struts are not round.
    """
    part = export.part
    if part.dimension != 3:
        raise InvalidSettings(
            f"3MF beams are round; the struts of {export.name!r}, a part in the plane, are not"
        )
    radii = 0.5 * part.widths
    corner = (part.positions[part.struts] - radii[:, None, None]).min(axis=(0, 1))
    nodes, ends = np.unique(part.struts, return_inverse=True)
    beams = "".join(
        f'<b:beam v1="{a}" v2="{b}" r1="{radius!r}"/>\n'
        for (a, b), radius in zip(ends.reshape(-1, 2).tolist(), radii.tolist(), strict=True)
    )
    mesh = (
        f"{_vertices(part.positions[nodes] - corner)}"
        f'<b:beamlattice minlength="{SHORTEST}" radius="{float(radii.max())!r}" cap="sphere">\n'
        f"<b:beams>\n{beams}</b:beams>\n</b:beamlattice>\n"
    )
    return _archive(_model(mesh, export.name, f' xmlns:b="{_BEAMS}" requiredextensions="b"'))


def _archive(model: str) -> bytes:
    """Return the file with a model."""
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for path, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", model),
        ):
            entry = zipfile.ZipInfo(path, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text)
    return content.getvalue()


def _vertices(points: NDArray[np.float64]) -> str:
    rows = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>\n' for x, y, z in points.tolist())
    return f"<vertices>\n{rows}</vertices>\n"


def _model(mesh: str, name: str, extension: str = "") -> str:
    readable = "".join(letter if letter.isprintable() else " " for letter in name)
    return (
        f'{_HEAD}<model unit="millimeter" xml:lang="en-US" '
        f'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"{extension}>\n'
        f'<metadata name="Title">{escape(readable)}</metadata>\n'
        '<metadata name="Application">bellcrank</metadata>\n'
        f'<resources><object id="1" type="model" name={quoteattr(readable)}><mesh>\n'
        f'{mesh}</mesh></object></resources>\n<build><item objectid="1"/></build>\n</model>\n'
    )


exporters.register("3mf")(Exporter((".3mf",), to_bytes))
exporters.register("3mf-beams")(Exporter((".beams.3mf",), beams_to_bytes))
