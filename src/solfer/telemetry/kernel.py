"""Compiled parts of a loop's telemetry. A file of its own, so that readers need not wait for the compiler."""

from pathlib import Path

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part
from solfer.numerics.pointers import indices_at, release_fence
from solfer.segments.header import CACHE_LINE
from solfer.segments.slot import NEWEST, STAMP_WORD, STATE_WORD
from solfer.telemetry import histograms

ROW_RING = BlockLayout(
    "RowRing",
    # addresses of the arrays, and their sizes
    pieces=int,
    arrays=(int, "pieces"),
    sizes=(int, "pieces"),
    # the ring: its words, how many rows it holds, and the words from one to the next
    size=int,
    words=(int, "size"),
    count=int,
    stride=int,
    number=(int, 1),
)
"""What `append` reads, and the number of the row that it wrote last."""

_bucket_of = part(histograms.bucket_of)
_ring_at = ROW_RING.at


def _append(address, stamp):
    """Publish the arrays as they are now as the next row; in the order that `Slots` protects."""
    ring = _ring_at(address)
    words = ring.words
    number = ring.number[0] + 1
    slot = CACHE_LINE // 8 + (number % ring.count) * ring.stride
    words[slot + STATE_WORD] = 2 * number - 1
    release_fence()  # the mark first, then stamp and numbers
    words[slot + STAMP_WORD] = stamp
    place = slot + CACHE_LINE // 8
    for piece in range(ring.pieces):
        array = indices_at(ring.arrays[piece], ring.sizes[piece])
        for index in range(len(array)):
            words[place + index] = array[index]
        place += len(array)
    words[slot + STATE_WORD] = 2 * number
    release_fence()  # no reader accepts a row that the index does not announce
    words[NEWEST] = number
    ring.number[0] = number


def _count_durations(rows, times, always):
    """Count one duration for each histogram; a zero counts only in the first `always` of them.

    Args:
        rows: The histograms, int64, shape (rows, histograms.ROW_WORDS).
        times: The durations, int64, shape (rows,) [ns].
        always: Number of histograms that count zeros.
    """
    for row in range(len(times)):
        time = times[row]
        if row < always or time != 0:
            rows[row, 0] += 1
            rows[row, 1] = max(rows[row, 1], time)
            rows[row, 2 + _bucket_of(time)] += 1


append = cached("void(int64, int64)", _append)
count_durations = cached(
    "void(int64[:, ::1], int64[::1], int64)", _count_durations, sources=[Path(histograms.__file__)]
)
