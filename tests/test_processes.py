"""Functions that are computed in processes."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.processes import FunctionProcess

if TYPE_CHECKING:
    from collections.abc import Callable


def send_then_fail(send: Callable[[object], None], error: Exception) -> None:
    send(np.arange(3))
    raise error


def send_then_wait(send: Callable[[object], None]) -> None:
    send("waiting")
    time.sleep(60.0)


def test_values_come_before_the_error_of_the_process() -> None:
    process = FunctionProcess(__name__, "send_then_fail", InvalidSettings("steps: too few"))
    values = iter(process)
    assert next(values).tolist() == [0, 1, 2]
    with pytest.raises(InvalidSettings, match="steps: too few"):
        next(values)


def test_an_error_that_is_no_error_of_bellcrank_keeps_its_name() -> None:
    values = iter(FunctionProcess(__name__, "send_then_fail", ZeroDivisionError("by zero")))
    next(values)
    with pytest.raises(RuntimeError, match="ZeroDivisionError: by zero"):
        next(values)


def test_a_killed_process_ends_at_once() -> None:
    process = FunctionProcess(__name__, "send_then_wait")
    values = iter(process)
    assert next(values) == "waiting"
    start = time.monotonic()
    process.kill()
    with pytest.raises(RuntimeError, match="ended with status"):
        next(values)
    assert time.monotonic() - start < 30.0
