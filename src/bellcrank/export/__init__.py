"""Export of parts to files, checks before printing, and slicing.

>>> from tempfile import TemporaryDirectory
>>> from bellcrank.model import human_design
>>> from bellcrank.part import PartSpec
>>> part = PartSpec(width=1.6, thickness=5.0).of(human_design("crane"))

Solids have the exact area of the outline, and a thickness of whole layers:

>>> bundle = Export(part=part, layer=0.32)
>>> bundle.thickness
5.12
>>> solid = bundle.solid()
>>> round(solid.volume / (part.outline().area * 5.12), 6)
1.0

The suffix determines the format of a file:

>>> with TemporaryDirectory() as folder:
...     for suffix in ("stl", "3mf", "dxf", "svg"):
...         export(bundle, f"{folder}/crane.{suffix}")

Features that a printer cannot reproduce are listed:

>>> rules = PrintRules(bead_width=0.40, layer=0.32)
>>> for warning in check_print(bundle, rules)[:2]:
...     print(warning.sentence)  # doctest: +ELLIPSIS
Struts 1.6 mm wide are not a whole number of 0.4 mm beads in 0.32 mm layers; ...
The thickness of 5 mm is not a whole number of layers of 0.32 mm; 16 layers are 5.12 mm.
"""

from bellcrank.export.beads import PrintRules
from bellcrank.export.checks import PrintWarning, check_print, checks
from bellcrank.export.formats import Export, Exporter, export, exporters
from bellcrank.export.solid import Solid, extruded, whole_layers

__all__ = [
    "Export",
    "Exporter",
    "PrintRules",
    "PrintWarning",
    "Solid",
    "check_print",
    "checks",
    "export",
    "exporters",
    "extruded",
    "whole_layers",
]
