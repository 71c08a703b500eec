"""Population count and trailing zeros of a 64-bit word, as single instructions."""
# The arguments of numba's intrinsic protocol are untyped.
# mypy: disable-error-code="no-untyped-def, no-untyped-call, call-arg, return-value"
# ruff: noqa: ARG001

from __future__ import annotations

import numpy as np

from bellcrank.mechanics.kernels._compile import intrinsic, kernel


@intrinsic
def _popcount(_typing, word):
    """Count the set bits of a uint64."""
    from numba import types

    def generate(context, builder, _signature, arguments):
        return builder.ctpop(arguments[0])

    return types.uint64(types.uint64), generate


@intrinsic
def _trailing_zeros(_typing, word):
    """Find the lowest set bit of a uint64 that is not zero."""
    from numba import types

    def generate(context, builder, _signature, arguments):
        return builder.cttz(arguments[0], context.get_constant(types.boolean, True))

    return types.uint64(types.uint64), generate


@kernel
def popcount(word: np.uint64) -> int:
    """Count the set bits of a word."""
    return np.int64(_popcount(word))


@kernel
def trailing_zeros(word: np.uint64) -> int:
    """Find the lowest set bit of a word that is not zero."""
    return np.int64(_trailing_zeros(word))
