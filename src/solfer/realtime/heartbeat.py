"""The heartbeat of the RT process: its executor writes it to shared memory in each cycle, other processes read it."""

import json
import time
from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.segments.segment import Segment
from solfer.telemetry import STATISTICS


class Heartbeat:
    """The heartbeat of an RT process, which may come, go and come back.

    Args:
        folder: The namespace's folder.

    Attributes:
        pid: The process of the newest beat; 0: none yet.
        generation: How often a heartbeat was begun in this namespace; 0: never.
        period: Time from one of its beats to the next [s]; 0 before the first.
    """

    POLL_PERIOD = 0.05
    """Time between two searches for a process that is missing, or has begun again [s]."""

    def __init__(self, folder: Path):
        self._path = folder / STATISTICS
        self._segment: Segment | None = None
        self.pid = self.generation = 0
        self.period = 0.0
        self._next_look = -float("inf")

    def beats(self) -> int | None:
        """Return a number that changes with each beat; None without a process, or before its begin or after its end.

        For a process that was killed or hangs the number stays the same. Does not block.
        """
        segment = self._segment
        if segment is None or segment.retired:
            now = time.monotonic()
            if now < self._next_look:
                return None
            self._next_look = now + self.POLL_PERIOD
            segment = self._attach()
            if segment is None:
                return None
        return segment.heartbeat or None

    def alive(self) -> bool:
        """Return whether the process still exists, running or hanging. Looks at a file."""
        return self._segment is not None and self._segment.owned()

    def age(self) -> float:
        """Return the time since the newest beat [s]; infinity before the first."""
        newest = self.beats()
        return float("inf") if newest is None else 1e-9 * (time.monotonic_ns() - newest)

    def _attach(self) -> Segment | None:
        """Attach to the present segment; None without a whole one of this boot of the machine."""
        try:
            segment = Segment.attach(self._path, STATISTICS)
        except MiddlewareError:
            segment = None
        self._segment = None if segment is None or segment.retired else segment
        if self._segment is not None:
            self.pid = segment.pid
            self.generation = segment.generation
            self.period = 1.0 / json.loads(segment.layout)["rate"]
        return self._segment
