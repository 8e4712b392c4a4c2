"""Arrays that are copied together, wherever they lie."""

import mmap

import numpy as np
from support.allocations import check_that_it_keeps_no_memory

from solfer.numerics.pieces import Pieces

SIGNALLING = 0x7FF0000000000001
"""Bits of a NaN that most arithmetic would change."""


def test_pieces_are_copied_as_they_are_now():
    far = np.frombuffer(mmap.mmap(-1, mmap.PAGESIZE))  # another part of the address space
    whole, counts = np.zeros(10), np.zeros(2, dtype=np.int64)
    arrays = [far[3:5], whole[2:4], counts, np.zeros(0), whole[:2], np.zeros((2, 2))]
    out = np.full(12, -1.0)
    pieces = Pieces(arrays, out)
    for number in range(3):
        for place, array in enumerate(arrays):
            array[...] = number + place
        counts[1] = SIGNALLING
        pieces.copy()
        expected = np.concatenate([array.reshape(-1).view(np.int64) for array in arrays])
        np.testing.assert_array_equal(out.view(np.int64), expected)


def test_nothing_is_copied_from_no_arrays():
    out = np.zeros(0)
    Pieces([], out).copy()
    Pieces([np.zeros(0)], out).copy()


def test_copy_keeps_no_memory():
    check_that_it_keeps_no_memory(Pieces([np.zeros(50), np.zeros(3)], np.zeros(53)).copy)
