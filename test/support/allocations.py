"""The memory that control cycles allocate."""

import gc
import tracemalloc
from collections.abc import Callable

BATCHES, CYCLES, WARM = 5, 300, 200
KEPT, TAKEN = 2048, 4096
"""What all these cycles may keep together, about a byte each, and what they may allocate at a time [bytes]."""
ATTEMPTS = 3
"""Times to measure: other threads of the process allocate, too, but not every time; a cycle that does does it again."""


def check_that_it_keeps_no_memory(cycle: Callable[[], object]) -> None:
    """Once it has run for a while, a cycle keeps nothing, and needs no more than some small objects meanwhile.

    What Python keeps of freed tuples for later ones is not the cycle's: the collector gives it back. Where that is
    off in the loop, it may find nothing else after it.
    """
    off, faults = not gc.isenabled(), ""
    for _ in range(ATTEMPTS):
        faults = _measure(cycle, off)
        if not faults:
            return
    raise AssertionError(faults)


def _measure(cycle: Callable[[], object], off: bool) -> str:
    """Run a cycle under tracemalloc; return what is wrong with what it allocates, and where, else nothing."""
    unreachable, taken = 0, 0
    gc.collect()
    tracemalloc.start()
    try:
        for _ in range(WARM):  # also what is kept from one cycle to the next was taken under these eyes then
            cycle()
        before = tracemalloc.take_snapshot()
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
        where = tracemalloc.take_snapshot().compare_to(before, "lineno")[:5] if kept >= KEPT else []
    finally:
        tracemalloc.stop()
    faults = [f"{kept} bytes stay: " + "; ".join(map(str, where))] if kept >= KEPT else []
    if off and unreachable:
        faults.append(f"{unreachable} objects refer to each other and stay")
    if taken > TAKEN:
        faults.append(f"{taken} bytes at a time")
    return "\n".join(faults)
