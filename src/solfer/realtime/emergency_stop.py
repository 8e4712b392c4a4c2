"""The emergency stop of the RT layer: a latched word in shared memory."""

import os
import time
from pathlib import Path

from solfer.middleware.shared_memory.memory.latched import latched

FILE, KIND, LAYOUT = "estop", "estop", b'{"words": ["tripped", "time [ns]", "pid", "answer [ns]"], "text": "reason"}'
TRIPPED, TIME, PID, ANSWER = range(4)
WORDS, TEXT = 4, 160  # [words], [B]


class EmergencyStopLatch:
    """A latch that every process may trip, and that stays, also when the process that made it ends or starts again.

    Only the executor clears it, when all plugins are at rest (`Executor.clear`).

    Args:
        folder: The namespace's folder, which exists; the first process makes the latch in it.

    Attributes:
        segment: Its memory.

    Raises:
        MiddlewareError: The folder cannot be used, or a foreign file is in the way.
    """

    def __init__(self, folder: Path):
        self.segment = latched(folder / FILE, KIND, LAYOUT, 8 * WORDS + TEXT)
        self._words = self.segment.data[: 8 * WORDS].cast("q")
        self._text = self.segment.data[8 * WORDS : 8 * WORDS + TEXT]

    def __bool__(self) -> bool:
        return bool(self._words[TRIPPED])

    @property
    def reason(self) -> str:
        """Why it was tripped, and by which process; empty while it is not."""
        if not self:
            return ""
        text = bytes(self._text).rstrip(b"\0").decode(errors="replace")
        return f"{text} (process {self._words[PID]})"

    @property
    def time(self) -> int:
        """Time at which it was tripped, on the monotonic clock [ns]."""
        return self._words[TIME]

    @property
    def answered(self) -> int:
        """Time at which an executor last held because of it, on the monotonic clock [ns]; 0: never."""
        return self._words[ANSWER]

    def trip(self, reason: str) -> None:
        """Trip the latch; the first reason stays."""
        if self:
            return
        self._text[:] = reason.encode(errors="replace")[:TEXT].ljust(TEXT, b"\0")
        self._words[TIME], self._words[PID] = time.monotonic_ns(), os.getpid()
        self._words[TRIPPED] = 1

    def answer(self) -> None:
        """Confirm as the executor that all plugins hold."""
        self._words[ANSWER] = time.monotonic_ns()

    def close(self) -> None:
        """Leave it to the others; tripped or not, it stays."""
        self.segment.leave()

    def clear(self) -> None:
        """Release the latch."""
        self._words[TRIPPED] = 0
