"""Efficiencies of designs, predicted by a trained network.

Examples
--------
A network for the crane is part of the package.

>>> from bellcrank.model import find_problem
>>> crane = find_problem("crane")
>>> predictor = load_predictor(crane)  # doctest: +SKIP
>>> predictor.predict(crane.initial[None])  # doctest: +SKIP
array([-0.06...])
"""

from __future__ import annotations

from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidModel, InvalidProblem
from bellcrank.surrogate.matching import require_same_problem
from bellcrank.surrogate.trained_model import MODEL, TrainedModel, read_model

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from bellcrank.model import Problem

BUNDLED = "pretrained/crane.safetensors"
"""The trained network that the package contains."""


class Predictor:
    """A trained network that is evaluated on designs of a problem.

    The problem's nodes and beams may be numbered differently from those of the problem that the
    network was trained on.

    Parameters
    ----------
    problem
        Its masks are the argument of `predict`.
    model
        The trained network.
    device
        Device of the network; see `bellcrank.surrogate.backend`.

    Raises
    ------
    InvalidModel
        If the network was trained on another problem.
    """

    def __init__(self, problem: Problem, model: TrainedModel, *, device: str = "auto") -> None:
        self.problem = problem
        self.model = model
        self.device = device
        require_same_problem(model.problem, problem)

    def predict(self, masks: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Predict the efficiencies of designs.

        Parameters
        ----------
        masks : (n, M) bool
            Over the beams of `problem`.

        Returns
        -------
        (n,) float64

        Raises
        ------
        InvalidProblem
            If the masks have another shape or type.
        InvalidSettings
            If the device is not available.
        InvalidModel
            If a prediction is not a finite number.
        """
        given = np.asarray(masks)
        beams = self.problem.lattice.beam_count
        if given.ndim != 2 or given.shape[1] != beams or given.dtype != np.bool_:
            raise InvalidProblem(
                f"masks: expected booleans of shape (n, {beams}), one for each beam of "
                f"{self.problem.name!r}, got {given.dtype} of shape {given.shape}"
            )
        packed = np.packbits(given, axis=1)
        predicted = self.model.predict(packed, device=self.device)
        wrong = np.flatnonzero(~np.isfinite(predicted))
        if len(wrong):
            raise InvalidModel(
                f"the {self.model.architecture} network predicts {predicted[wrong[0]]} for design "
                f"{wrong[0]}; its file may be damaged"
            )
        return predicted


def load_predictor(
    problem: Problem,
    path: str | os.PathLike[str] | None = None,
    *,
    device: str = "auto",
    any_stiffness: bool = False,
) -> Predictor:
    """Load a trained network for a problem.

    Parameters
    ----------
    path
        File of a trained network, or the folder of its training; the bundled network by default.
    any_stiffness
        Accept a problem with another stiffness or section than the network was trained on, such as
        that of a design for a part. The predictor's problem then has those of the training.

    Raises
    ------
    InvalidModel
        If the network was trained on another problem or is damaged, or there is no bundled one.
    InvalidFile
        If there is no such file.
    InvalidSettings
        If PyTorch is not installed.
    """
    model = load_model(problem, path, any_stiffness=any_stiffness)
    given = as_trained(problem, model) if any_stiffness else problem
    return Predictor(given, model, device=device)


def as_trained(problem: Problem, model: TrainedModel) -> Problem:
    """Return a problem with the mechanical model and the stiffness of the training."""
    known = model.problem
    return replace(
        problem, stiffness=known.stiffness, section=known.section, material=known.material
    )


def load_model(
    problem: Problem, path: str | os.PathLike[str] | None = None, *, any_stiffness: bool = False
) -> TrainedModel:
    """Read a trained network from a file or folder, or the bundled network.

    Parameters and errors are those of `load_predictor`.
    """
    with resources.as_file(resources.files("bellcrank.surrogate") / BUNDLED) as bundled:
        file = bundled if path is None else Path(path)
        if file.is_dir():
            file /= MODEL
            if not file.exists():
                raise InvalidFile(f"{path}: no trained model in this folder; expected {MODEL}")
        model = read_model(file)
    given = as_trained(problem, model) if any_stiffness else problem
    try:
        require_same_problem(model.problem, given)
    except InvalidModel as error:
        if path is not None:
            raise
        raise InvalidModel(
            f"no bundled network for {problem.name!r} ({error}); train one (bellcrank dataset "
            f"build, bellcrank train) and give its file or folder"
        ) from None
    return model
