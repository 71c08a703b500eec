"""Parts of a problem as plain data for files and hashes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.model.conditions import ROLLERS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model.conditions import Input, Output, Supports
    from bellcrank.model.specification import Specification


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
