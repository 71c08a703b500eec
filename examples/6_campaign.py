"""
Many runs
=========

One search is an anecdote. A campaign makes as many as wanted, on one core or a cluster, and
survives any kill.
"""

# %%
# What to run
# -----------

from pathlib import Path

from bellcrank.campaign import Store, Watcher, best_designs, complete, read_spec

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
# An engine only decides where: in this process (``serial``), on all cores (``local``), or on a
# cluster by Dask. All leave the same bytes. On a cluster, ``bellcrank campaign run sizes.toml
# --engine slurm`` does it (:doc:`/campaigns`).

complete(store, "serial")
status = Watcher(store).look()
print(status.runs_done, "runs,", status.steps_done, "steps")

# %%
# What came out
# -------------

for best in best_designs(store, 4):
    print(f"{best.task}, seed {best.seed}, step {best.step}: {best.efficiency:.3f}")
