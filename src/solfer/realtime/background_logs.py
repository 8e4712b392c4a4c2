"""Logging from a loop that must not wait for a terminal or a disk."""

import contextlib
import logging
from collections.abc import Iterator
from logging.handlers import QueueHandler, QueueListener
from queue import SimpleQueue


@contextlib.contextmanager
def logged_apart() -> Iterator[None]:
    """Write log records in a thread of its own while the context lasts."""
    queue: SimpleQueue[logging.LogRecord] = SimpleQueue()
    root = logging.getLogger()
    handlers = root.handlers[:]
    listener = QueueListener(queue, *handlers, respect_handler_level=True)
    root.handlers[:] = [QueueHandler(queue)]
    listener.start()
    try:
        yield
    finally:
        listener.stop()
        root.handlers[:] = handlers
