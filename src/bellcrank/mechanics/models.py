"""The mechanical models behind one interface: springs and frames."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.evaluator import SpringEvaluator, core_code
from bellcrank.mechanics.frames.evaluator import FrameEvaluator

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.analysis import Strain
    from bellcrank.mechanics.evaluator import FlipPrediction, Response, UnloadedBeams
    from bellcrank.mechanics.output import OutputMotion
    from bellcrank.model import Design, Problem


class ModelEvaluator(Protocol):
    """Responses of designs of one problem by a mechanical model."""

    problem: Problem

    def evaluate(
        self,
        mask: ArrayLike,
        largest_increment: float = 1.0,
        *,
        warm_start: bool = False,
        lower_bound: float = -math.inf,
    ) -> Response:
        """Load a design from rest to the full stroke; see `SpringEvaluator.evaluate`."""

    def set_reference(self) -> None:
        """Make the design evaluated last the reference of warm starts."""

    def predict_flips(
        self, mask: ArrayLike, beams: ArrayLike | None = None
    ) -> FlipPrediction | None:
        """Predict the effect of flips on the design evaluated last."""

    def load_bearing(self, mask: ArrayLike) -> NDArray[np.bool_]:
        """Return (M,) the beams of a design that can carry load."""

    def core_finder(self) -> Callable[[NDArray[np.bool_]], NDArray[np.bool_]]:
        """Return a function like `load_bearing` that leaves the last response as it is."""

    def for_problem(self, problem: Problem) -> ModelEvaluator:
        """Return an evaluator of the displacement in another problem, with the same settings."""

    def strain(self) -> Strain:
        """Return energies and input forces in the response computed last."""

    def largest_strain(self) -> float:
        """Return the largest strain of a beam in the response computed last.

        The spring model has axial strain only, frames the largest principal strain.
        """

    def output_motion(self) -> OutputMotion:
        """Return the motion of the output in the response computed last."""

    def output_stiffness(self) -> float:
        """Return the stiffness of the output; see `bellcrank.mechanics.output_stiffness`."""


def model_name(problem: Problem) -> str:
    """Return the mechanical model of a problem: ``"frames"`` with a section, else ``"springs"``."""
    return "springs" if problem.section is None else "frames"


def model_evaluator(
    problem: Problem,
    objective: str | None = None,
    unloaded_beams: UnloadedBeams = "keep",
    elements: int | None = None,
) -> ModelEvaluator:
    """Return the evaluator of the mechanical model of a problem.

    Parameters
    ----------
    problem
        A problem with a section is evaluated as a frame, one without by the spring model.
    objective
        Name of an objective; that of the problem by default.
    unloaded_beams
        Treatment of beams without load by the spring model; frames do not depend on them.
    elements : int, optional
        Number of linear elements of each beam of a frame; None for the element of searches, which
        includes the shortening of bent beams (`FrameEvaluator`).

    Raises
    ------
    InvalidSettings, UnknownName
        If a setting is not valid, or a number of elements is asked of the spring model.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> type(model_evaluator(find_problem("crane"))).__name__
    'SpringEvaluator'
    """
    core_code(unloaded_beams)  # raises InvalidSettings
    if problem.section is not None:
        return FrameEvaluator(problem, objective, elements)
    if elements is not None:
        raise InvalidSettings(
            f"elements: only beams of frames are divided, the spring model is not; got {elements!r}"
        )
    return SpringEvaluator(problem, objective, unloaded_beams)


def load_bearing_core(design: Design) -> NDArray[np.bool_]:
    """Return (M,) the beams of a design that can carry load: see `SpringEvaluator.load_bearing`.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane").full_design()
    >>> bool(load_bearing_core(crane).all())
    True
    """
    return model_evaluator(design.problem, "displacement").load_bearing(design.mask)
