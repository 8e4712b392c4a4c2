"""The memory that control cycles allocate."""

import gc
import tracemalloc
from collections.abc import Callable

BATCHES, CYCLES, WARM = 10, 1000, 200
KEPT, TAKEN = 512, 4096
"""What all these cycles may keep together, and what they may allocate at a time [bytes]."""


def check_that_it_keeps_no_memory(cycle: Callable[[], object]) -> None:
    """Once it has run for a while, a cycle keeps nothing, and needs no more than some small objects meanwhile.

    What Python keeps of freed tuples for later ones is not the cycle's: the collector gives it back. Where that is
    off in the loop, it may find nothing else after it.
    """
    off, unreachable, taken = not gc.isenabled(), 0, 0
    gc.collect()
    tracemalloc.start()
    try:
        for _ in range(WARM):  # also what is kept from one cycle to the next was taken under these eyes then
            cycle()
        gc.collect()
        first = tracemalloc.get_traced_memory()[0]
        for _ in range(BATCHES):
            for _ in range(WARM):  # fills the lists of free tuples, which the collector emptied
                cycle()
            tracemalloc.reset_peak()
            start = tracemalloc.get_traced_memory()[0]
            for _ in range(CYCLES):
                cycle()
            taken = max(taken, tracemalloc.get_traced_memory()[1] - start)
            unreachable += gc.collect()
        kept = tracemalloc.get_traced_memory()[0] - first
    finally:
        tracemalloc.stop()
    assert kept < KEPT
    assert not (off and unreachable), f"{unreachable} objects refer to each other and stay"
    assert taken <= TAKEN
