"""Logging that does not flood: a repeated message comes out once a second, with the number of repetitions."""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager

KEYS = 64
"""Number of keys that are distinguished."""

OTHER_KEYS = "others"


class Throttle:
    """Passes one message a second for each key to a logger.

    Args:
        logger: Receives the messages.
        interval: Shortest time between two messages of one key [s].
    """

    def __init__(self, logger: logging.Logger, interval: float = 1.0):
        self._logger = logger
        self._interval = interval
        self._last: dict[str, float] = {}
        self._held: dict[str, int] = {}

    def warning(self, key: str, text: str, *args: object) -> bool:
        """Log `text` (with `args`, as in logging) unless `key` was logged less than `interval` ago; return whether."""
        now = time.monotonic()
        if key not in self._last and len(self._last) >= KEYS and not self._make_room(now):
            key = OTHER_KEYS
        if now - self._last.get(key, -float("inf")) < self._interval:
            self._held[key] = self._held.get(key, 0) + 1
            return False
        held = self._held.pop(key, 0)
        self._last[key] = now
        self._logger.warning(text + (f" ({held} more like this)" if held else ""), *args)
        return True

    def _make_room(self, now: float) -> bool:
        """Forget keys that were logged long ago with their counts; return whether there is room for another key."""
        for key, last in list(self._last.items()):
            if now - last >= self._interval:
                self._last.pop(key, None)
                self._held.pop(key, None)
        return len(self._last) < KEYS


@contextmanager
def logged_once() -> Iterator[None]:
    """Pass each text to the handlers of the root logger once, however often it is logged within."""
    seen = set[tuple[logging.Handler, str]]()
    handlers = [each for each in (*logging.getLogger().handlers, logging.lastResort) if each is not None]
    filters = []
    for handler in handlers:

        def is_new(record: logging.LogRecord, handler: logging.Handler = handler) -> bool:
            key = handler, record.getMessage()
            known = key in seen
            seen.add(key)
            return not known

        handler.addFilter(is_new)
        filters.append((handler, is_new))
    try:
        yield
    finally:
        for handler, each in filters:
            handler.removeFilter(each)
