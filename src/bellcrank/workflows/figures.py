"""Figures of a response: efficiency, motion of the output, input force."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.mechanics import Status, model_name

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import ModelEvaluator, Response
    from bellcrank.model import Problem


def figures_of(evaluator: ModelEvaluator, response: Response) -> dict[str, Any]:
    """Return the figures of the response computed last as plain data.

    Lengths and forces are in lattice units. Vectors have one component for each axis; the rotation
    of the output is an angle in the plane and a rotation vector in space. Numbers that are not
    finite, and the motion of a design without a stable equilibrium, are None.

    Examples
    --------
    >>> from bellcrank.mechanics import model_evaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> evaluator = model_evaluator(crane)
    >>> figures = figures_of(evaluator, evaluator.evaluate(crane.initial))
    >>> figures["status"], round(figures["output_rotation_deg"], 2)
    ('converged', -1.57)
    """
    row: dict[str, Any] = {
        "efficiency": _number(response.efficiency),
        "energy": _number(response.energy),
        "status": response.status.label,
        **dict.fromkeys(("output_displacement", "output_rotation_deg", "off_axis", "input_force")),
    }
    if response.status in {Status.CONVERGED, Status.SNAPPED}:
        moved = evaluator.output_motion()
        row |= {
            "output_displacement": _vector(moved.displacement),
            "output_rotation_deg": _vector(moved.rotation),
            "off_axis": _number(moved.off_axis),
            "input_force": _vector(evaluator.strain().input_forces.sum(axis=0)),
        }
    return row


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _vector(values: NDArray[np.float64]) -> Any:
    """Return a number or a list of numbers; None if they are not finite."""
    return values.tolist() if np.isfinite(values).all() else None


def model_record(problem: Problem, elements: int | None = None) -> dict[str, Any]:
    """Return the mechanical model of a problem as plain data.

    A frame has the number of elements of each beam, and whether they include the shortening of
    bent beams (``bowing``); see `bellcrank.mechanics.FrameEvaluator`.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> frame = frame_problem(human_design("crane").problem, PartSpec())
    >>> model_record(frame)
    {'model': 'frames', 'elements': 1, 'bowing': True}
    >>> model_record(frame, elements=8)
    {'model': 'frames', 'elements': 8, 'bowing': False}
    """
    if problem.section is None:
        return {"model": model_name(problem)}
    return {"model": model_name(problem), "elements": elements or 1, "bowing": elements is None}


def model_words(problem: Problem, elements: int | None = None) -> str:
    """Return the mechanical model of a problem in words.

    Parameters
    ----------
    elements
        As in `bellcrank.mechanics.FrameEvaluator`.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> model_words(find_problem("crane"))
    'spring model'
    """
    if model_name(problem) == "springs":
        return "spring model"
    if elements is None:
        return "frames, as searched"
    return f"frames, {elements} element{'s' * (elements > 1)}"


def size_of(vector: float | list[float] | None) -> float:
    """Return the size of a vector, the value of a number and nan for None."""
    if vector is None:
        return math.nan
    return math.hypot(*vector) if isinstance(vector, list) else vector


def figure_text(value: float | list[float] | None, form: str) -> str:
    """Return the size of a figure as text, a dash for None."""
    return "-" if value is None else form.format(size_of(value))
