"""The type that numba gives to a `Bundle`, and the machine code that reads its table.

Imports numba; imported when the first kernel is compiled or called.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.types import Array, Type, boolean, float64, int64
from numba.core.types.containers import BaseTuple
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, models, register_model, unbox
from numba.np import numpy_support
from numba.np.arrayobj import make_array, populate_array

if TYPE_CHECKING:
    from llvmlite.ir import IRBuilder, Value

WORD = ir.IntType(64)


class BundleType(Type):
    """Type of a bundle: its name, and the names and types of its fields.

    Parameters
    ----------
    name
        Of the class.
    members
        Pairs of name and numba type, in the order of the table.
    """

    def __init__(self, name: str, members: tuple[tuple[str, Any], ...]) -> None:
        self.members = members
        self.class_name = name
        parts = ", ".join(f"{field}: {kind}" for field, kind in members)
        super().__init__(name=f"{name}({parts})")

    @property
    def key(self) -> tuple[Any, ...]:
        """What makes two types equal."""
        return self.class_name, self.members

    def member(self, name: str) -> tuple[Any, int] | None:
        """Return the type of a field and its first entry in the table; None if there is none."""
        offset = 0
        for field, kind in self.members:
            if field == name:
                return kind, offset
            offset += _size(kind)
        return None


def type_of(bundle: Any) -> BundleType:
    """Return the type of a `bellcrank.mechanics.kernels.bundle.Bundle`."""
    names = type(bundle).__match_args__
    key = type(bundle), *(_key(getattr(bundle, name)) for name in names)
    if key not in _known:
        members = tuple((name, _kind(getattr(bundle, name))) for name in names)
        _known[key] = BundleType(type(bundle).__name__, members)
    return _known[key]


_known: dict[tuple[Any, ...], BundleType] = {}
"""Types that were made, by what determines them; numba takes long to compare types."""


def _key(value: Any) -> Any:
    """Return what determines the type of the value of a field."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim
    if hasattr(value, "_numba_type_"):
        return id(value._numba_type_)
    if isinstance(value, tuple):
        return type(value), *(_key(each) for each in value)
    return type(value)


def _kind(value: Any) -> Any:
    """Return the numba type of the value of a field."""
    if isinstance(value, np.ndarray):
        return Array(numpy_support.from_dtype(value.dtype), value.ndim, "C")
    if hasattr(value, "_numba_type_"):
        return value._numba_type_
    if isinstance(value, tuple):
        kinds = [_kind(each) for each in value]
        if hasattr(value, "_fields"):
            return BaseTuple.from_types(kinds, type(value))
        return BaseTuple.from_types(kinds)
    if isinstance(value, bool):
        return boolean
    return int64 if isinstance(value, int) else float64


def _size(kind: Any) -> int:
    """Return the number of entries of a type in the table."""
    if isinstance(kind, Array):
        return 1 + int(kind.ndim)
    if isinstance(kind, BaseTuple):
        return sum(_size(each) for each in kind)
    return 1


@register_model(BundleType)
class _BundleModel(models.PrimitiveModel):  # type: ignore[misc]
    """A bundle is the address of its table."""

    def __init__(self, manager: Any, kind: BundleType) -> None:
        super().__init__(manager, kind, WORD.as_pointer())


@unbox(BundleType)
def _unbox(_kind: BundleType, value: Value, context: Any) -> NativeValue:
    """Read the address from the Python object."""
    address = context.pyapi.object_getattr_string(value, "address")
    pointer = context.pyapi.long_as_voidptr(address)
    context.pyapi.decref(address)
    typed = context.builder.bitcast(pointer, WORD.as_pointer())
    return NativeValue(typed, is_error=cgutils.is_null(context.builder, pointer))


@infer_getattr
class _BundleAttribute(AttributeTemplate):  # type: ignore[misc]
    """Types of the fields."""

    key = BundleType

    def generic_resolve(self, kind: BundleType, name: str) -> Any:
        """Return the type of a field."""
        found = kind.member(name)
        return None if found is None else found[0]


@lower_getattr_generic(BundleType)
def _read(context: Any, builder: IRBuilder, kind: BundleType, value: Value, name: str) -> Value:
    """Generate the code that reads a field."""
    found = kind.member(name)
    assert found is not None  # the type of the attribute was found before
    return _load(context, builder, found[0], value, found[1])


def _load(context: Any, builder: IRBuilder, kind: Any, table: Value, offset: int) -> Value:
    """Generate the code that reads a value from the table, which nothing changes."""

    def word(index: int, content: Any = WORD) -> Value:
        pointer = builder.gep(table, [ir.Constant(WORD, offset + index)])
        entry = builder.load(builder.bitcast(pointer, content.as_pointer()))
        entry.set_metadata("invariant.load", builder.module.add_metadata([]))
        return entry

    if isinstance(kind, Array):
        array = make_array(kind)(context, builder)
        shape = [word(1 + axis) for axis in range(kind.ndim)]
        size = context.get_abi_sizeof(context.get_data_type(kind.dtype))
        stride: Value = ir.Constant(WORD, size)
        strides: list[Value] = []
        for extent in reversed(shape):
            strides.insert(0, stride)
            stride = builder.mul(stride, extent)
        data = word(0, context.get_data_type(kind.dtype).as_pointer())
        populate_array(array, data, shape, strides, size, None)
        return array._getvalue()  # noqa: SLF001 - numba's own protocol
    if isinstance(kind, BaseTuple):
        parts = []
        for each in kind:
            parts.append(_load(context, builder, each, table, offset))
            offset += _size(each)
        return context.make_tuple(builder, kind, parts)
    if isinstance(kind, BundleType):
        return word(0, WORD.as_pointer())
    if kind == float64:
        return word(0, ir.DoubleType())
    if kind == boolean:
        return builder.icmp_unsigned("!=", word(0), ir.Constant(WORD, 0))
    return word(0)
