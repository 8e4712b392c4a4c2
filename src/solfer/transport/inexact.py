"""Reports orientations from outside that have not quite the length 1, and get it."""

import logging

logger = logging.getLogger(__name__)


class InexactOrientations:
    """Reports the first inexact orientation of each sender; see `normalize`."""

    def __init__(self) -> None:
        self._senders: set[str] = set()

    def report(self, sender: str) -> None:
        """Log that an orientation of a sender was inexact, unless it was before."""
        # no more: senders whose name changes each time do not fill the memory
        if sender not in self._senders and len(self._senders) < 100:
            self._senders.add(sender)
            logger.warning("quaternions of %s have not quite the length 1: they get it", sender or "an unknown sender")
