"""A problem written out in full, as plain data: schema ``bellcrank/problem/1``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.model.masks import pack_mask

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model.problem import Problem

PROBLEM_SCHEMA = "bellcrank/problem/1"


def problem_to_dict(problem: Problem) -> dict[str, Any]:
    """Write a problem out as lists, numbers and text, ready for JSON.

    Two problems are equal exactly if these are, so that the hash of a problem
    is taken from here.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> data = problem_to_dict(find_problem("crane"))
    >>> data["schema"], data["input"]["direction"], len(data["designable"])
    ('bellcrank/problem/1', [0.0, -1.0], 203)
    """
    data: dict[str, Any] = {
        "schema": PROBLEM_SCHEMA,
        "name": problem.name,
        "positions": problem.lattice.positions.tolist(),
        "beams": problem.lattice.beams.tolist(),
        "initial": pack_mask(problem.initial),
        "designable": problem.designable.tolist(),
        "stiffness": {"bond": problem.stiffness.bond, "angle": problem.stiffness.angle},
        "supports": {
            "fixed": problem.supports.fixed.tolist(),
            "fixed_x": problem.supports.fixed_x.tolist(),
            "fixed_y": problem.supports.fixed_y.tolist(),
        },
        "input": {
            "nodes": problem.input.nodes.tolist(),
            "direction": _one_or_each(problem.input.direction),
            "drive": problem.input.drive,
            "amount": problem.input.amount,
        },
        "output": {
            "nodes": problem.output.nodes.tolist(),
            "direction": _one_or_each(problem.output.direction),
            "spring": problem.output.spring,
            "spring_kind": problem.output.spring_kind,
        },
        "aggregate": problem.aggregate,
    }
    if problem.objective is not None:
        data["objective"] = problem.objective
    return data


def _one_or_each(vectors: NDArray[np.float64]) -> list[Any]:
    """Write one vector where all are the same."""
    same = bool((vectors == vectors[0]).all())
    written: list[Any] = vectors[0].tolist() if same else vectors.tolist()
    return written
