"""Problems and their parts as plain data for files and hashes."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from bellcrank.model.conditions import ROLLERS
from bellcrank.model.masks import pack_mask

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model.conditions import Input, Output, Supports
    from bellcrank.model.problem import Problem
    from bellcrank.model.specification import Specification

PROBLEM_SCHEMA = "bellcrank/problem/1"


def problem_to_dict(problem: Problem) -> dict[str, Any]:
    """Return a problem in full as plain data (schema ``bellcrank/problem/1``).

    Two problems are equal if and only if their data are equal: `Problem.hash` is computed from
    them.

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
        "supports": supports_data(problem.supports, problem.lattice.dimension),
        "input": input_data(problem.input),
        "output": output_data(problem.output),
        "aggregate": problem.aggregate,
    }
    wanted, dimension = problem.specification, problem.lattice.dimension
    optional = {
        "objective": problem.objective,
        "section": problem.section and problem.section.to_dict(),
        "material": problem.material and asdict(problem.material),
        "widths": None if problem.widths is None else problem.widths.tolist(),
        "joints": None if problem.joints is None else problem.joints.tolist(),
        "loads": problem.loads.to_dict() if problem.loads else None,
        "specification": wanted and specification_data(wanted, dimension),
    }
    return data | {key: value for key, value in optional.items() if value is not None}


def supports_data(supports: Supports, dimension: int) -> dict[str, Any]:
    """Return supports; in space also those fixed in z."""
    names = ("fixed", *ROLLERS[:dimension])
    return {name: getattr(supports, name).tolist() for name in names}


def input_data(given: Input) -> dict[str, Any]:
    """Return an input."""
    data = {
        "nodes": given.nodes.tolist(),
        "direction": _one_or_each(given.direction),
        "drive": given.drive,
        "amount": given.amount,
    }
    if given.during is not None:
        data["during"] = _one_or_each(given.during)
    return data


def output_data(output: Output) -> dict[str, Any]:
    """Return an output."""
    return {
        "nodes": output.nodes.tolist(),
        "direction": _one_or_each(output.direction),
        "spring": output.spring,
        "spring_kind": output.spring_kind,
    }


def specification_data(specification: Specification, dimension: int) -> dict[str, Any]:
    """Return a specification."""
    data: dict[str, Any] = {"case": specification.case, "output": specification.output}
    if specification.outputs:
        data["outputs"] = {name: output_data(each) for name, each in specification.outputs.items()}
    if specification.cases:
        data["cases"] = [
            {
                "name": case.name,
                "supports": supports_data(case.supports, dimension),
                "input": input_data(case.input),
                "outputs": {name: output_data(each) for name, each in case.outputs.items()},
                **({"loads": case.loads.to_dict()} if case.loads else {}),
            }
            for case in specification.cases
        ]
    data["items"] = [item.to_dict() for item in specification.items]
    data["maximise"] = [objective.to_dict() for objective in specification.maximise]
    if specification.weight is not None:
        data["weight"] = specification.weight.tolist()
    if specification.symmetry:
        data["symmetry"] = list(specification.symmetry)
    if specification.domain:
        data["domain"] = [ring.tolist() for ring in specification.domain]
    if specification.tolerances is not None:
        data["tolerances"] = specification.tolerances.to_dict()
    return data


def _one_or_each(vectors: NDArray[np.float64]) -> list[Any]:
    """Return one vector if all are equal, otherwise all of them."""
    same = bool((vectors == vectors[0]).all())
    written: list[Any] = vectors[0].tolist() if same else vectors.tolist()
    return written
