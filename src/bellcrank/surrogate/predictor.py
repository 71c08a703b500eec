"""Predictions for the problem at hand, by one network or by several that keep each other honest.

Examples
--------
A network for the crane comes with bellcrank.

>>> import numpy as np
>>> from bellcrank.model import find_problem
>>> crane = find_problem("crane")
>>> predictor = load_predictor(crane)  # doctest: +SKIP
>>> predictor.predict(np.array([crane.initial]))  # doctest: +SKIP
Prediction(efficiency=array([-0.06...]), spread=None)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidModel, InvalidProblem
from bellcrank.surrogate.matching import beams_between, renumbered
from bellcrank.surrogate.trained import TrainedModel, read_model

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.onnx import OnnxModel

SHIPPED = ("crane",)
"""Problems that a trained network comes with bellcrank for."""


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """What networks say of designs.

    Parameters
    ----------
    efficiency : (n,) float64
        Mean over the networks.
    spread : (n,) float64 or None
        Standard deviation between them: how much they dispute. None for a single one.
    """

    efficiency: NDArray[np.float64]
    spread: NDArray[np.float64] | None


class Predictor:
    """Networks that have learnt one problem, asked about designs as numbered in another file.

    Parameters
    ----------
    problem
        At hand; its masks are what `predict` takes.
    members
        Networks that have learnt it.
    device, precision
        Where and how they compute.

    Raises
    ------
    InvalidModel
        If there is none, or one has learnt something else.
    """

    def __init__(
        self,
        problem: Problem,
        members: Sequence[TrainedModel | OnnxModel],
        *,
        device: str = "auto",
        precision: str = "float32",
    ) -> None:
        if not members:
            raise InvalidModel("expected at least one trained model")
        self.problem = problem
        self.members = tuple(members)
        self.device = device
        self.precision = precision
        self._beams = [beams_between(member.problem, problem) for member in self.members]

    def predict(self, masks: NDArray[np.bool_]) -> Prediction:
        """Predict the efficiencies of designs.

        Parameters
        ----------
        masks : (n, M) bool
            Over the beams of `problem`.

        Raises
        ------
        InvalidProblem
            If they are not that.
        InvalidSettings
            If the device or the precision makes no sense here.
        InvalidModel
            If a network says something that is no number.
        """
        given = np.asarray(masks)
        beams = self.problem.lattice.beam_count
        if given.ndim != 2 or given.shape[1] != beams or given.dtype != np.bool_:
            raise InvalidProblem(
                f"masks: expected booleans of shape (n, {beams}), one for each beam of "
                f"{self.problem.name!r}, got {given.dtype} of shape {given.shape}"
            )
        said = np.array(
            [
                member.predict(
                    np.packbits(renumbered(given, beams_there), axis=1),
                    device=self.device,
                    precision=self.precision,
                )
                for member, beams_there in zip(self.members, self._beams, strict=True)
            ]
        )
        wrong = np.argwhere(~np.isfinite(said))
        if len(wrong):
            member, design = wrong[0].tolist()
            raise InvalidModel(
                f"network {member + 1} of {len(said)}, a {self.members[member].architecture}, says "
                f"{said[member, design]} of design {design}; its file may be damaged"
            )
        spread = said.std(axis=0, ddof=1) if len(said) > 1 else None
        return Prediction(said.mean(axis=0), spread)


def load_predictor(
    problem: Problem,
    paths: Sequence[str | os.PathLike[str]] = (),
    *,
    device: str = "auto",
    precision: str = "float32",
    any_stiffness: bool = False,
) -> Predictor:
    """Return a predictor for a problem.

    Parameters
    ----------
    paths
        Files of trained models; by default the one that comes with bellcrank.
    any_stiffness
        Whether a problem of another stiffness will do, as that of a design for a part: networks
        know one, and the predictor's problem has that.

    Raises
    ------
    InvalidModel
        If none comes with bellcrank, or one of them has learnt another problem or is damaged.
    InvalidFile
        If there is no such file.
    InvalidSettings
        If PyTorch is not installed.
    """
    members = [_read(path) for path in paths] or load_models(problem, any_stiffness=any_stiffness)
    asked = _as_learnt(members[0].problem, problem) if any_stiffness else problem
    return Predictor(asked, members, device=device, precision=precision)


def load_models(
    problem: Problem, paths: Sequence[str | os.PathLike[str]] = (), *, any_stiffness: bool = False
) -> list[TrainedModel]:
    """Return trained networks for a problem: those in files, or the one that comes with bellcrank.

    Parameters
    ----------
    paths, any_stiffness
        As for `load_predictor`.

    Raises
    ------
    InvalidModel
        If none comes with bellcrank, or one of them has learnt another problem or is damaged.
    InvalidFile, InvalidSettings
        As `load_predictor`.
    """
    if paths:
        found = [read_model(path) for path in paths]
        for model in found:
            _require_fit(model, problem, any_stiffness=any_stiffness)
        return found
    refusals = []
    for name in SHIPPED:
        source = resources.files("bellcrank.surrogate") / "pretrained" / f"{name}.safetensors"
        with resources.as_file(source) as path:
            model = read_model(path)
        try:
            _require_fit(model, problem, any_stiffness=any_stiffness)
        except InvalidModel as error:
            refusals.append(str(error))
        else:
            return [model]
    raise InvalidModel(
        f"no trained model for {problem.name!r} comes with bellcrank ({refusals[0]}); train one "
        f"(bellcrank dataset build, bellcrank train) and name its file or folder"
    )


def _require_fit(model: TrainedModel, problem: Problem, *, any_stiffness: bool) -> None:
    """Refuse a network that has learnt something else."""
    asked = _as_learnt(model.problem, problem) if any_stiffness else problem
    beams_between(model.problem, asked)


def _as_learnt(known: Problem, given: Problem) -> Problem:
    """Return the problem at hand with the stiffness of the one that is known."""
    return replace(given, stiffness=known.stiffness)


def _read(path: str | os.PathLike[str]) -> TrainedModel | OnnxModel:
    """Read a network for PyTorch, or for ONNX Runtime where the name says so."""
    if Path(path).suffix == ".onnx":
        from bellcrank.surrogate.onnx import read_onnx

        return read_onnx(path)
    return read_model(path)
