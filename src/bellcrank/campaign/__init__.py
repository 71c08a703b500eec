"""Campaigns: many runs, on one core or thousands, in a store that survives a kill at any instant.

A **spec** names problems, searches and seeds. Each run is one chain; `work` computes one and
writes its proposals to the **store**, a folder of files that are written once. An **engine**
decides where runs are computed; all engines leave the same bytes.

Examples
--------
>>> import tempfile
>>> from pathlib import Path
>>> scratch = tempfile.TemporaryDirectory()
>>> path = Path(scratch.name) / "spec.toml"
>>> _ = path.write_text('''
... name = "first"
... segment = 250
... [[tasks]]
... problem = "scaling-8"
... search = "paper"
... steps = 500
... seeds = 2
... ''')
>>> store = Store.create(Path(scratch.name) / "first", read_spec(path))
>>> complete(store, "serial")
True
>>> status = StatusReader(store).read()
>>> status.runs_done, status.steps_done, status.compacted
(2, 1000, True)
>>> best = best_designs(store, 3)
>>> best[0].efficiency == status.tasks[0].best
True
>>> scratch.cleanup()
"""

from bellcrank.campaign.compaction import compact
from bellcrank.campaign.completion import Shard, complete
from bellcrank.campaign.engines import EngineOptions, engines
from bellcrank.campaign.results import RankedDesign, TaskResult, best_designs, write_results
from bellcrank.campaign.spec import Run, Spec, Task, read_spec
from bellcrank.campaign.status import Status, StatusReader, TaskStatus
from bellcrank.campaign.store import Store
from bellcrank.campaign.verification import Verification, repair, verify
from bellcrank.campaign.work import work

__all__ = [
    "EngineOptions",
    "RankedDesign",
    "Run",
    "Shard",
    "Spec",
    "Status",
    "StatusReader",
    "Store",
    "Task",
    "TaskResult",
    "TaskStatus",
    "Verification",
    "best_designs",
    "compact",
    "complete",
    "engines",
    "read_spec",
    "repair",
    "verify",
    "work",
    "write_results",
]
