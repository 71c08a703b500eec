"""
Train a network
===============

This example trains a small network to predict the efficiency of designs. :doc:`/surrogate` compares
networks with the mechanics.
"""

# %%
# Data
# ----
# Searches that maximise and searches that minimise the efficiency propose designs. All proposals
# are stored with their efficiency and their run, so that a network is tested on other runs than
# those of its training set.

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
# The simplest network takes the bits of a design, one for each beam. ``resnet18-w16`` takes its
# picture; it is more accurate for the same training set and takes 25 times as long.

training = begin(data, recipe_of("own", model="mlp", epochs=6), Path("network"), device="cpu")
for _ in training.run():
    pass
model = training.finish()
for epoch in training.log:
    print(f"epoch {epoch.epoch}: R2 {epoch.r_squared:.3f}")

# %%
# Prediction
# ----------
# Predicted and exact efficiency of designs of the held-out runs.

held_out = training.split.held_out[:5]
predictions = model.predict(data.packed[held_out])
for predicted, exact in zip(predictions, data.efficiency[held_out], strict=True):
    print(f"predicted {predicted:+.3f}, exact {exact:+.3f}")

# %%
# On the command line: ``bellcrank dataset build scaling-8``, ``bellcrank train scaling-8-dataset``,
# ``bellcrank predict scaling-8 --designs designs.json``.
