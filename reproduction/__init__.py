"""Reproduction of the figures and tables of the paper, Bonfanti et al. (2020), and comparisons.

Each study is a module with full and quick settings. It computes plain figures from stored raw
results, draws one picture, and compares the figures with the paper in rows. `run_study` writes
the record and the picture to a folder.

Examples
--------
>>> from reproduction import studies
>>> studies["paths"].title
"Efficiency along the chains of the paper's search"
"""

from reproduction import structure  # noqa: I001 - registered in the order of the paper
from reproduction import paths
from reproduction import actuators
from reproduction import scaling
from reproduction import disorder
from reproduction import amplitude
from reproduction import angular_springs
from reproduction import learning
from reproduction import regions
from reproduction import rivals
from reproduction.measured import study as measured
from reproduction.frame_benchmarks import study as frame_benchmarks
from reproduction.result_store import ResultStore
from reproduction.records import draw_record, read_record, read_records, run_study
from reproduction.registry import Claim, Study, studies

__all__ = [
    "Claim",
    "ResultStore",
    "Study",
    "actuators",
    "amplitude",
    "angular_springs",
    "disorder",
    "draw_record",
    "frame_benchmarks",
    "learning",
    "measured",
    "paths",
    "read_record",
    "read_records",
    "regions",
    "rivals",
    "run_study",
    "scaling",
    "structure",
    "studies",
]
