"""
Train a network
===============

A network can learn to predict the efficiency from a picture of a design. When that pays, and when
it does not, is told honestly on :doc:`/surrogate`; here is how it goes.
"""

# %%
# Data
# ----
# Searches for and against the wanted motion propose designs; all of them are kept with their
# efficiency, in runs, so that a network is tested on runs that it has never seen.

from pathlib import Path

from bellcrank.campaign.dataset import DatasetSpec, build_dataset
from bellcrank.model import find_problem
from bellcrank.surrogate.recipes import recipe_of
from bellcrank.surrogate.training_setup import begin

problem = find_problem("scaling-8")
data = build_dataset(DatasetSpec(problem=problem, runs=40, steps=400), Path("dataset"))
print(len(data), "designs of", data.run_count, "runs")

# %%
# Training
# --------
# The simplest network looks at the bits of a design, one for each beam. ``resnet18-w16`` looks at
# its picture, learns far more from as many designs, and takes 25 times as long (:doc:`/surrogate`).

training = begin(data, recipe_of("own", model="mlp", epochs=6), Path("network"), device="cpu")
for _ in training.run():
    pass
model = training.finish()
for epoch in training.log:
    print(f"epoch {epoch.epoch}: R2 {epoch.r_squared:.3f}")

# %%
# Asking it
# ---------
# Designs of runs that it has never seen, and what the mechanics says of them.

held_out = training.split.held_out[:5]
for told, true in zip(model.predict(data.packed[held_out]), data.efficiency[held_out], strict=True):
    print(f"predicted {told:+.3f}, in truth {true:+.3f}")

# %%
# On the command line: ``bellcrank dataset build scaling-8``, ``bellcrank train scaling-8-dataset``,
# ``bellcrank predict scaling-8 --designs designs.json``.
