"""Addresses of arrays, and what compiled loops make of them: they read arrays that an array of addresses names."""

from typing import Any

import numpy as np
from numba import carray, njit, types
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


def _fence(ordering: str) -> Any:
    """Make a function that keeps accesses to memory in order, on each side of it, as other processors see them."""

    @intrinsic
    def fence(_typing):
        def generate(context, builder, _signature, _arguments):
            builder.fence(ordering)
            return context.get_dummy_value()

        return types.void(), generate

    return fence


acquire_fence = _fence("acquire")
"""acquire_fence(): all later accesses wait for all earlier reads."""
release_fence = _fence("release")
"""release_fence(): all later writes wait for all earlier accesses."""


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
