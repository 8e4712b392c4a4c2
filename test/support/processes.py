"""Processes of tests, which really end when they are killed, and waits for what they do."""

import contextlib
import multiprocessing
import time
from pathlib import Path

import solfer.errors

SOURCES = Path(solfer.errors.__file__).parents[1]
"""Folder from which this process imports solfer: kernels that are imported from elsewhere would be compiled again."""

BOUND = 60.0
"""Longest time of a wait, on a machine that has much else to do [s]."""

LOOK = 0.002
"""Time between two checks of a condition [s]."""

SPAWN = multiprocessing.get_context("spawn")


def until(condition, what="what another process does", bound=BOUND):
    """Wait for a condition; fails after `bound` [s] with what was missing, a text or a function that returns one."""
    end = time.monotonic() + bound
    while not condition():
        assert time.monotonic() < end, f"not within {bound:g} s: {what() if callable(what) else what}"
        time.sleep(LOOK)


@contextlib.contextmanager
def process(target, place, *args):
    """Start a process that runs `target(place, ready, *args)`; returns when it has set `ready`."""
    ready = SPAWN.Event()
    child = SPAWN.Process(target=target, args=(place, ready, *args), daemon=True)
    child.start()
    try:
        assert ready.wait(BOUND)
        yield child
    finally:
        kill(child)


def kill(child):
    """Kill a process."""
    child.kill()
    child.join(BOUND)
    assert not child.is_alive()
