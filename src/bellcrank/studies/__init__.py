"""The paper's figures and tables, remade by commands.

Each study is a module with its settings, full and quick; it computes plain figures from raw
records that it keeps, draws one picture from them, and says in rows what of it compares with
Bonfanti et al. (2020). `run_study` leaves record and picture in a folder.

Examples
--------
>>> from bellcrank.studies import studies
>>> studies["paths"].title
"Efficiency along the paper's chains"
"""

from bellcrank.studies import structure  # noqa: I001 - registered in the order of the paper
from bellcrank.studies import paths
from bellcrank.studies import actuators
from bellcrank.studies import scaling
from bellcrank.studies import disorder
from bellcrank.studies import amplitude
from bellcrank.studies import angular_springs
from bellcrank.studies import learning
from bellcrank.studies import seeing
from bellcrank.studies import rivals
from bellcrank.studies.bench import Bench
from bellcrank.studies.records import draw_record, read_record, read_records, run_study
from bellcrank.studies.registry import Claim, Study, studies

__all__ = [
    "Bench",
    "Claim",
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
