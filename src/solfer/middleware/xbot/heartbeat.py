"""Whether the RT process still cycles: its executor beats in shared memory with each cycle, and others look."""

import json
import time
from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.board import FILE, KIND
from solfer.middleware.xbot.segment import Segment

LOOK = 0.05
"""Time between two looks for a process that was not there, or has begun anew [s]."""


class Pulse:
    """The beats of an RT process, which may come, go and come back.

    Args:
        folder: The namespace's folder.

    Attributes:
        pid: The process that beat last; 0: none yet.
        generation: How often the beats were begun in this namespace; 0: never.
        period: Time from one of its beats to the next [s]; 0 before the first.
    """

    def __init__(self, folder: Path):
        self._path, self._segment = folder / FILE, None
        self.pid = self.generation = 0
        self.period, self._next_look = 0.0, -float("inf")

    def beats(self) -> int | None:
        """A number that changes with each beat; None while there is no process, or it has not yet begun or has ended.

        A process that was killed or hangs beats the same number for ever. Does not block.
        """
        segment = self._segment
        if segment is None or segment.retired:
            now = time.monotonic()
            if now < self._next_look:
                return None
            self._next_look = now + LOOK
            segment = self._attach()
            if segment is None:
                return None
        return segment.heartbeat or None

    def alive(self) -> bool:
        """Whether the process still runs or hangs; false after its end, however it came. Costs a look at a file."""
        return self._segment is not None and self._segment.owned()

    def age(self) -> float:
        """Time since the newest beat [s]; infinity before the first."""
        newest = self.beats()
        return float("inf") if newest is None else 1e-9 * (time.monotonic_ns() - newest)

    def _attach(self) -> Segment | None:
        """The present segment; None if there is none that is whole and of this boot of the machine."""
        try:
            segment = Segment.attach(self._path, KIND)
        except MiddlewareError:
            segment = None
        self._segment = None if segment is None or segment.retired else segment
        if self._segment is not None:
            self.pid, self.generation = segment.pid, segment.generation
            self.period = 1.0 / json.loads(segment.layout)["rate"]
        return self._segment
