"""The paper's figures and tables, remade by commands.

Each study is a module with its settings, full and quick; it computes plain figures from raw
records that it keeps, draws one picture from them, and says in rows what of it compares with
Bonfanti et al. (2020). `run_study` leaves record and picture in a folder.

Examples
--------
>>> from reproduction import studies
>>> studies["paths"].title
"Efficiency along the paper's chains"
"""

from reproduction import structure  # noqa: I001 - registered in the order of the paper
from reproduction import paths
from reproduction import actuators
from reproduction import scaling
from reproduction import disorder
from reproduction import amplitude
from reproduction import angular_springs
from reproduction import learning
from reproduction import seeing
from reproduction import rivals
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
    "learning",
    "paths",
    "read_record",
    "read_records",
    "rivals",
    "run_study",
    "scaling",
    "seeing",
    "structure",
    "studies",
]
