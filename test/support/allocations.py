"""The memory that control cycles allocate."""

import gc
import tracemalloc
from collections.abc import Callable

CYCLES, WARM = 10_000, 200
KEPT, TAKEN = 512, 4096
"""What all these cycles may keep together, and what they may allocate at a time [bytes]."""


def check_that_it_keeps_no_memory(cycle: Callable[[], object]) -> None:
    """Once it has run for a while, a cycle keeps nothing, and needs no more than some small objects meanwhile."""
    gc.collect()
    tracemalloc.start()
    try:
        for _ in range(WARM):  # also what is kept from one cycle to the next was taken under these eyes then
            cycle()
        tracemalloc.reset_peak()
        start = tracemalloc.get_traced_memory()[0]
        for _ in range(CYCLES):
            cycle()
        end, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert end - start < KEPT
    assert peak - start <= TAKEN
