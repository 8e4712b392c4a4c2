"""LAPACK for compiled functions, from SciPy's own library. A function that is compiled with it names `LAPACK`."""

from pathlib import Path
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import get_cython_function_address, intrinsic

from solfer.numerics.compilation import exact_part

LAPACK = Path(__file__)

_INTEGER = ir.IntType(32)
_LETTER = ir.IntType(8)
_NUMBERS = ir.DoubleType().as_pointer()


def dposv_address() -> int:
    """Return the address of LAPACK's dposv in this process, which a block holds: compiled functions are cached."""
    return get_cython_function_address("scipy.linalg.cython_lapack", "dposv")


@intrinsic
def _dposv(_typing: Any, function: Any, matrix: Any, right: Any, size: Any) -> Any:
    """Call dposv by its address, for the lower triangle and one right side."""
    signature = types.int32(types.int64, types.int64, types.int64, types.int64)

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        at, matrix, right, size = arguments
        whole = _INTEGER.as_pointer()
        kinds = [_LETTER.as_pointer(), whole, whole, _NUMBERS, whole, _NUMBERS, whole, whole]
        dposv = builder.inttoptr(at, ir.FunctionType(ir.VoidType(), kinds).as_pointer())
        lower = cgutils.alloca_once_value(builder, _LETTER(ord("L")))
        one = cgutils.alloca_once_value(builder, _INTEGER(1))
        count = cgutils.alloca_once_value(builder, builder.trunc(size, _INTEGER))
        failed = cgutils.alloca_once_value(builder, _INTEGER(0))
        matrix, right = (builder.inttoptr(each, _NUMBERS) for each in (matrix, right))
        builder.call(dposv, [lower, count, one, matrix, count, right, count, failed])
        return builder.load(failed)

    return signature, generate


@exact_part
def solve_positive(dposv, matrix, vector):
    """Solve A x = b in place for a symmetric positive definite matrix, as `scipy.linalg.lapack.dposv` does.

    Args:
        dposv: See `dposv_address`.
        matrix: Its upper triangle, row by row; overwritten, shape (n, n).
        vector: b, then x, shape (n,).

    Returns:
        Whether the matrix is positive definite; x means nothing otherwise.
    """
    return _dposv(dposv, matrix.ctypes.data, vector.ctypes.data, len(vector)) == 0
