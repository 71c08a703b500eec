"""Storage of runs: all proposals of a search on disk, safe against a kill at any instant.

A run is a folder. Its description (``run.json``) holds problem and settings. Each chain adds
Parquet files that are written once, each with the state from which the chain continues in its
footer, so that rows and state become valid together or not at all. `RunFolder.finish` merges them
into one ``history.parquet``. `bellcrank.campaign` stores its runs in the same segments.

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

from bellcrank.storage.files import remove_temporaries, require_new_folder, unused_folder
from bellcrank.storage.records import COLUMNS, Proposals
from bellcrank.storage.run_folder import RunFolder, check_no_run, is_unfinished_run

__all__ = [
    "COLUMNS",
    "Proposals",
    "RunFolder",
    "check_no_run",
    "is_unfinished_run",
    "remove_temporaries",
    "require_new_folder",
    "unused_folder",
]
