"""Processes of tests, which really end when they are killed."""

import contextlib
import multiprocessing
from pathlib import Path

import solfer.errors

SOURCES = Path(solfer.errors.__file__).parents[1]
"""Folder from which this process imports solfer: kernels that are imported from elsewhere would be compiled again."""

BOUND = 60.0
"""Longest time until a process is ready or has ended, on a machine that has much else to do [s]."""

SPAWN = multiprocessing.get_context("spawn")


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
