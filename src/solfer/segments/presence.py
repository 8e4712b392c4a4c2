"""Checks that a process can still be found: the files by which others reach it may be removed while it runs."""

import time
from collections.abc import Sequence

from solfer.errors import MiddlewareError
from solfer.segments.namespace import Namespace, lost
from solfer.segments.segment import Segment


class Presence:
    """Checks whether the folder of a namespace, and what stops a process, are still those that the process has opened.

    Mapped memory outlives its file. A process that has lost the files still shares memory with those that have lost
    them, too, but no other one finds it: no command, no emergency stop. So it has to bring the robot to rest and end.

    Args:
        namespace: The namespace.
        segments: Segments by which the process is stopped, or that hold its heartbeat.

    Attributes:
        loss: What became of the files, in one line; empty while all is well.
    """

    PERIOD = 0.1
    """Time between two checks [s]."""

    def __init__(self, namespace: Namespace, segments: Sequence[Segment] = ()):
        self._namespace = namespace
        self._segments = tuple(segments)
        self.loss = ""
        self._due = time.monotonic() + self.PERIOD

    def look(self) -> None:
        """Check once, with one system call for each file."""
        gone = (lost(segment.path) for segment in self._segments if not segment.in_place())
        self.loss = self.loss or self._namespace.loss() or next(gone, "")

    def lost(self) -> bool:
        """Return whether the files are lost; may be called in every cycle, checks once per `PERIOD`."""
        now = time.monotonic()
        if now >= self._due:
            self._due = now + self.PERIOD
            self.look()
        return bool(self.loss)

    def require(self) -> None:
        """Check that nothing is lost.

        Raises:
            MiddlewareError: The files are lost.
        """
        if self.loss:
            raise MiddlewareError(
                f"no other process finds this one any more: {self.loss}",
                expected="a new start, which makes the namespace again",
            )
