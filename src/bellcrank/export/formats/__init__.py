"""Formats of exported files, one file per format.

A new one is an `Exporter` in a file of its own under ``exporters.register("name")``, imported
below; the contract tests pick it up by themselves.

>>> exporters.names()
['stl', '3mf', 'step', 'dxf', 'svg', 'vtu', 'lammps', 'dump']
"""

from bellcrank.export.formats import stl  # isort: skip
from bellcrank.export.formats import threemf  # isort: skip
from bellcrank.export.formats import step  # isort: skip
from bellcrank.export.formats import dxf  # isort: skip
from bellcrank.export.formats import svg  # isort: skip
from bellcrank.export.formats import vtu  # isort: skip
from bellcrank.export.formats import lammps  # isort: skip
from bellcrank.export.formats import dump  # isort: skip
from bellcrank.export.formats.base import Export, Exporter, export, exporter_for, exporters

__all__ = [
    "Export",
    "Exporter",
    "dump",
    "dxf",
    "export",
    "exporter_for",
    "exporters",
    "lammps",
    "step",
    "stl",
    "svg",
    "threemf",
    "vtu",
]
