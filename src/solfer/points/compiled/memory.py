"""Arrays by their addresses."""

from numba import types
from numba.extending import intrinsic


def _pointer_to(kind):
    @intrinsic
    def pointer(_typing, address):
        signature = types.CPointer(kind)(types.int64)

        def generate(context, builder, signature, arguments):
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return signature, generate

    return pointer


floats = _pointer_to(types.float64)
"""floats(address): pointer for `numba.carray`."""

integers = _pointer_to(types.int64)
"""integers(address): pointer for `numba.carray`."""
