"""Trained networks that predict the efficiency of designs.

A `Dataset` holds designs (packed masks) with their efficiencies. `training_setup.begin` trains a
network on it by a `Recipe`; the result is a `TrainedModel`. A `Predictor` evaluates it on the
designs of a problem, and `NetworkEvaluator` lets a search use it in place of the mechanics.

Examples
--------
>>> from bellcrank.model import find_problem
>>> from bellcrank.surrogate.dataset import Dataset
>>> from bellcrank.surrogate.predictor import Predictor
>>> from bellcrank.surrogate.recipes import recipe_of
>>> from bellcrank.surrogate.training_setup import begin
>>> import numpy as np
>>> problem = find_problem("scaling-8")
>>> masks = np.random.default_rng(0).random((400, problem.lattice.beam_count)) < 0.8
>>> run = np.arange(400) // 40
>>> data = Dataset(problem, np.packbits(masks, axis=1), masks.mean(axis=1), run)
>>> training = begin(data, recipe_of("own", model="mlp", epochs=1), device="cpu")
>>> for progress in training.run():
...     pass
>>> predictor = Predictor(problem, training.finish(), device="cpu")
>>> predictor.predict(masks[:3]).shape
(3,)
"""
