"""Population count and trailing zeros of a 64-bit word, as single instructions."""
# numba's intrinsic protocol hands over its own untyped objects.
# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from numba import types
from numba.extending import intrinsic


@intrinsic
def popcount(_typing, word):
    """Number of set bits of a uint64."""

    def generate(context, builder, _signature, arguments):  # noqa: ARG001
        return builder.ctpop(arguments[0])

    return types.uint64(types.uint64), generate


@intrinsic
def trailing_zeros(_typing, word):
    """Index of the lowest set bit of a uint64 that is not zero."""

    def generate(context, builder, _signature, arguments):  # noqa: ARG001
        return builder.cttz(arguments[0], context.get_constant(types.boolean, True))

    return types.uint64(types.uint64), generate
