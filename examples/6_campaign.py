"""
A campaign on a cluster
=======================

A campaign runs many searches, on one core or a cluster, and survives a kill at any instant.
"""

# %%
# What to run
# -----------

from pathlib import Path

from bellcrank.campaign import (
    StatusReader,
    Store,
    best_designs,
    complete,
    read_spec,
    write_results,
)
from bellcrank.plots import draw_comparison
from bellcrank.workflows.pictures import motion_of

Path("sizes.toml").write_text("""
name = "sizes"
segment = 250

[[tasks]]
problem = "scaling-8"
search = "paper"
steps = 500
seeds = 6

[[tasks]]
problem = "scaling-10"
search = "paper"
steps = 500
seeds = 6
""")
store = Store.create(Path("sizes"), read_spec(Path("sizes.toml")))

# %%
# Where to run
# ------------
# An engine decides where runs are computed: in this process (``serial``), on all cores
# (``processes``), or on a cluster (``dask``, ``slurm``). All leave the same bytes, so a campaign
# may start on one machine and end on another. This example uses one process; on a cluster whose
# machines share the folder, the command is
#
# .. code-block:: console
#
#     $ bellcrank campaign run sizes.toml --engine slurm --workers 200 --slurm queue=short
#
# or, in each job of a job array,
#
# .. code-block:: console
#
#     $ bellcrank campaign run sizes.toml --shard $SLURM_ARRAY_TASK_ID/100
#
# and ``bellcrank campaign watch sizes`` shows the status (:doc:`/campaigns`).

complete(store, "serial")
status = StatusReader(store).read()
print(status.runs_done, "runs,", status.steps_done, "steps")

# %%
# What came out
# -------------

for best in best_designs(store, 4):
    print(f"{best.task}, seed {best.seed}, step {best.step}: {best.efficiency:.3f}")

# %%
# The best design of each task, without unloaded beams and evaluated again from rest:

small, large = write_results(store, Path("designs"))
draw_comparison(
    motion_of(small.design, name=small.task),
    motion_of(large.design, name=large.task),
    "results.png",
)
