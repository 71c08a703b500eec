"""Runs: what a search proposed, kept on disk so that a kill loses nothing.

A run is a folder. Its description (``run.json``) says what was asked for; each chain
adds write-once Parquet shards, each with the state to go on from in its footer, so that
rows and state take effect together or not at all. `RunFolder.finish` merges them into
one ``history.parquet``.

Examples
--------
>>> import tempfile
>>> import numpy as np
>>> from bellcrank.model import find_problem
>>> problem = find_problem("scaling-8")
>>> masks = np.repeat(np.packbits(problem.initial)[None], 3, axis=0)
>>> rows = Proposals(masks, np.array([0.1, 0.3, 0.2]), np.zeros(3), np.full(3, 0.06),
...                  np.array([True, True, False]), np.zeros(3, np.int8))
>>> scratch = tempfile.TemporaryDirectory()
>>> run = RunFolder.create(f"{scratch.name}/run", problem, {"steps": 3})
>>> run.append(0, 0, rows, state={"step": 3})
>>> run.progress(0)
(3, {'step': 3})
>>> run.finish()
>>> run = RunFolder.open(run.path)
>>> run.status, run.read(0, ["efficiency"])["efficiency"].tolist()
('finished', [0.1, 0.3, 0.2])
>>> scratch.cleanup()
"""

from bellcrank.storage.files import remove_temporaries
from bellcrank.storage.folder import RunFolder
from bellcrank.storage.layout import check_free
from bellcrank.storage.records import COLUMNS, ProposalColumns, Proposals

__all__ = [
    "COLUMNS",
    "ProposalColumns",
    "Proposals",
    "RunFolder",
    "check_free",
    "remove_temporaries",
]
