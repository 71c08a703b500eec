"""Errors as the page receives them."""

from __future__ import annotations

from typing import Any


def plain_error(error: BaseException) -> dict[str, Any]:
    """Return message and key of an error, as the page receives them.

    Examples
    --------
    >>> plain_error(ValueError("task: output.nodes: node 5 is also in input.nodes"))
    {'message': 'output.nodes: node 5 is also in input.nodes', 'key': 'output.nodes'}
    """
    message = str(error).splitlines()[0] if str(error) else type(error).__name__
    message = (
        message.removeprefix("task: ").removeprefix("the file: ").removeprefix("the machine: ")
    )
    head = message.partition(":")[0]
    named = head.replace(".", "").replace("_", "").replace("[", "").replace("]", "").isalnum()
    return {"message": message, "key": head if named and " " not in head else ""}
