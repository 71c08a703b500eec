"""3MF: a named object of triangles in mm, for slicers.

Only the core specification is used: slicers do not open its beam-lattice extension.
"""

from __future__ import annotations

import zipfile
from io import BytesIO
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
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
_DATE = (1980, 1, 1, 0, 0, 0)
"""Date in the archive, constant so that files of equal parts are equal."""


def to_bytes(export: Export) -> bytes:
    """Return the part as a 3MF file."""
    return solid_to_bytes(export.solid(), export.name)


def solid_to_bytes(solid: Solid, name: str) -> bytes:
    """Return a closed surface as a 3MF file with one object."""
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for path, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", _model(solid, name)),
        ):
            entry = zipfile.ZipInfo(path, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text)
    return content.getvalue()


def _model(solid: Solid, name: str) -> str:
    vertices = "".join(
        f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>\n' for x, y, z in solid.vertices.tolist()
    )
    triangles = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in solid.triangles.tolist()
    )
    readable = "".join(letter if letter.isprintable() else " " for letter in name)
    return (
        f'{_HEAD}<model unit="millimeter" xml:lang="en-US" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">\n'
        f'<metadata name="Title">{escape(readable)}</metadata>\n'
        '<metadata name="Application">bellcrank</metadata>\n'
        f'<resources><object id="1" type="model" name={quoteattr(readable)}><mesh>\n'
        f"<vertices>\n{vertices}</vertices>\n<triangles>\n{triangles}</triangles>\n"
        '</mesh></object></resources>\n<build><item objectid="1"/></build>\n</model>\n'
    )


exporters.register("3mf")(Exporter((".3mf",), to_bytes))
