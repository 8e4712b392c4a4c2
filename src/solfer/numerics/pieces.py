"""Copies many arrays into one by a single call, which stays the same as long as the arrays live."""

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import as_strided

from solfer.numerics.compilation import cached


def _copy(memory, begins, sizes, out):
    """Write the pieces of a memory to `out`, one after the other."""
    place = 0
    for piece in range(len(begins)):
        begin = begins[piece]
        for index in range(sizes[piece]):
            out[place] = memory[begin + index]
            place += 1


copy = cached("void(int64[::1], int64[::1], int64[::1], int64[::1])", _copy)


class Pieces:
    """Arrays that are copied together.

    Args:
        arrays: Contiguous arrays of eight bytes a number; what is copied are their bits.
        out: Where they go, one after the other, of the same kind and as long as all of them.
    """

    def __init__(self, arrays: Sequence[np.ndarray], out: np.ndarray):
        self._arrays = [array.reshape(-1).view(np.int64) for array in arrays]  # they live as long as the pieces
        addresses = np.array([array.ctypes.data for array in self._arrays], dtype=np.int64)
        self._sizes = np.array([array.size for array in self._arrays], dtype=np.int64)
        if len(addresses):
            lowest = int(np.argmin(addresses))
            # one array from the first to the last of them: the memory between them is never read
            size = int(np.max(addresses + 8 * self._sizes) - addresses[lowest]) // 8
            self._memory = as_strided(self._arrays[lowest], (size,), (8,))
            self._begins = (addresses - addresses[lowest]) // 8
        else:
            self._memory, self._begins = np.zeros(0, dtype=np.int64), addresses
        self._out = out.reshape(-1).view(np.int64)

    def copy(self) -> None:
        """Copy all arrays as they are now."""
        copy(self._memory, self._begins, self._sizes, self._out)
