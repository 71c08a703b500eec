"""Formats of exported files, one module for each.

To add one, register an `Exporter` with ``exporters.register("name")`` in a module of this folder
and import it below. The contract tests include every registered format.

>>> exporters.names()
['stl', '3mf', '3mf-beams', 'step', 'dxf', 'svg', 'vtu', 'lammps']
"""

from bellcrank.export.formats import stl  # isort: skip
from bellcrank.export.formats import threemf  # isort: skip
from bellcrank.export.formats import step  # isort: skip
from bellcrank.export.formats import dxf  # isort: skip
from bellcrank.export.formats import svg  # isort: skip
from bellcrank.export.formats import vtu  # isort: skip
from bellcrank.export.formats import lammps  # isort: skip
from bellcrank.export.formats.base import Export, Exporter, export, exporters

__all__ = [
    "Export",
    "Exporter",
    "dxf",
    "export",
    "exporters",
    "lammps",
    "step",
    "stl",
    "svg",
    "threemf",
    "vtu",
]
