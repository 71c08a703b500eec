"""Campaigns: many runs, on one core or thousands, in a store that survives anything.

A **spec** names problems, searches and seeds. Each run is one chain; `work` computes one and
puts what it finds into the **store**, a folder of write-once files. An **engine** only decides
where that happens, so all of them leave the same bytes.

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
>>> status = Watcher(store).look()
>>> status.runs_done, status.steps_done, status.compacted
(2, 1000, True)
>>> best = best_designs(store, 3)
>>> best[0].efficiency == status.tasks[0].best
True
>>> scratch.cleanup()
"""

from bellcrank.campaign.compaction import compact
from bellcrank.campaign.drive import Shard, complete
from bellcrank.campaign.engines import EngineOptions, engines
from bellcrank.campaign.harvest import Harvest, write_harvest
from bellcrank.campaign.ranking import Ranked, best_designs
from bellcrank.campaign.spec import Run, Spec, Task, read_spec
from bellcrank.campaign.status import Status, TaskStatus, Watcher
from bellcrank.campaign.store import Store
from bellcrank.campaign.verification import Verification, repair, verify
from bellcrank.campaign.work import work

__all__ = [
    "EngineOptions",
    "Harvest",
    "Ranked",
    "Run",
    "Shard",
    "Spec",
    "Status",
    "Store",
    "Task",
    "TaskStatus",
    "Verification",
    "Watcher",
    "best_designs",
    "compact",
    "complete",
    "engines",
    "read_spec",
    "repair",
    "verify",
    "work",
    "write_harvest",
]
