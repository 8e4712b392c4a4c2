"""Logging that does not flood: a repeated message comes out once a second, with the number of repetitions."""

import logging
import time


class Throttle:
    """Passes one message a second for each key to a logger.

    Args:
        logger: Where the messages go.
        interval: Shortest time between two messages of one key [s].
    """

    def __init__(self, logger: logging.Logger, interval: float = 1.0):
        self._logger, self._interval = logger, interval
        self._last: dict[str, float] = {}
        self._held: dict[str, int] = {}

    def warning(self, key: str, text: str, *args: object) -> None:
        """Log `text` (with `args`, as in logging) unless `key` was logged less than `interval` ago."""
        now = time.monotonic()
        if now - self._last.get(key, -float("inf")) < self._interval:
            self._held[key] = self._held.get(key, 0) + 1
            return
        held = self._held.pop(key, 0)
        self._last[key] = now
        self._logger.warning(text + (f" ({held} more like this)" if held else ""), *args)
