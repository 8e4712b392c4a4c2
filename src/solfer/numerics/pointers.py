"""Addresses of arrays, and what compiled loops make of them: they read arrays that an array of addresses names."""

from typing import Any

import numpy as np
from numba import carray, from_dtype, njit, types
from numba.extending import intrinsic


def pointer_to(kind: types.Type) -> Any:
    """Make the function that turns an address into a pointer to numbers or records of a type, for `numba.carray`."""

    @intrinsic
    def pointer(_typing, address):
        signature = types.CPointer(kind)(types.int64)

        def generate(context, builder, signature, arguments):
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return signature, generate

    return pointer


floats = pointer_to(types.float64)
"""floats(address): pointer for `numba.carray`; the others as this."""
integers = pointer_to(types.int64)
booleans = pointer_to(types.boolean)


@intrinsic
def release_fence(_typing):
    """Let other processors see all that was written before no later than what is written afterwards."""

    def generate(context, builder, _signature, _arguments):
        builder.fence("release")
        return context.get_dummy_value()

    return types.void(), generate


def address(array: np.ndarray) -> int:
    """Return the address of an array's memory; 0 if it has no entries. Its user keeps the array alive."""
    return array.__array_interface__["data"][0] if array.size else 0


@njit
def vector_at(start, size):
    """Return the numbers at an address, shape (size,)."""
    return carray(floats(start), (size,))


@njit
def matrix_at(start, rows, columns):
    """Return the numbers at an address, shape (rows, columns)."""
    return carray(floats(start), (rows, columns))


@njit
def indices_at(start, size):
    """Return the whole numbers at an address, shape (size,)."""
    return carray(integers(start), (size,))


@njit
def flags_at(start, size):
    """Return the truth values at an address, shape (size,)."""
    return carray(booleans(start), (size,))


def record_at(kind: np.dtype) -> Any:
    """Make the function that returns the record of a kind at an address; see `Memory`."""
    records = records_at(kind)

    @njit
    def record(start):
        return records(start, 1)[0]

    return record


def records_at(kind: np.dtype) -> Any:
    """Make the function that returns the records of a kind at an address, shape (count,)."""
    pointer = pointer_to(from_dtype(kind))

    @njit
    def records(start, count):
        return carray(pointer(start), (count,))

    return records


class Memory:
    """A record of numbers and of addresses of arrays, which a compiled loop gets as one number; it keeps them alive.

    Args:
        kind: The record: of float64 numbers, and of int64 numbers, which may be addresses.
        fields: Numbers, and arrays that are contiguous and stay where they are; what is left out is 0.

    Attributes:
        record: The record, of which numbers may be changed, shape ().
        address: Its address.
    """

    def __init__(self, kind: np.dtype, **fields: Any):
        self.record, self._arrays = np.zeros((), kind), tuple(fields.values())
        for name, value in fields.items():
            if isinstance(value, np.ndarray):
                assert value.flags.c_contiguous, name
                assert value.dtype.names or value.dtype in (np.float64, np.int64, np.bool_), name
            self.record[name] = address(value) if isinstance(value, np.ndarray) else value
        self.address = address(self.record)
