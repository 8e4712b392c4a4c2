"""Logging out of a loop that must not wait for a terminal or a disk."""

import contextlib
import logging
from collections.abc import Iterator
from logging.handlers import QueueHandler, QueueListener
from queue import SimpleQueue


@contextlib.contextmanager
def logged_apart() -> Iterator[None]:
    """What is logged meanwhile is written by a thread of its own, which waits while there is nothing."""
    root, queue = logging.getLogger(), SimpleQueue()
    handlers = root.handlers[:]
    listener = QueueListener(queue, *handlers, respect_handler_level=True)
    root.handlers[:] = [QueueHandler(queue)]
    listener.start()
    try:
        yield
    finally:
        listener.stop()
        root.handlers[:] = handlers
