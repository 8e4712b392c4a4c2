"""The emergency stop of the RT layer: a latched word in shared memory."""

import os
import time
from pathlib import Path

from solfer.middleware.xbot.latched import latched

FILE, KIND, LAYOUT = "estop", "estop", b'{"words": ["tripped", "time [ns]", "pid"], "text": "reason"}'
TRIPPED, TIME, PID = range(3)
WORDS, TEXT = 3, 168  # [words], [B]


class EmergencyStop:
    """A word that everybody may set, and that stays set, also when the one who made it ends or starts again.

    It is cleared by the executor alone, when nothing runs (`Executor.clear`).

    Args:
        folder: The namespace's folder; whoever comes first makes the word in it.

    Raises:
        MiddlewareError: The folder cannot be used, or a foreign file is in the way.
    """

    def __init__(self, folder: Path):
        self._segment = latched(folder / FILE, KIND, LAYOUT, 8 * WORDS + TEXT)
        self._words = self._segment.data[: 8 * WORDS].cast("q")
        self._text = self._segment.data[8 * WORDS : 8 * WORDS + TEXT]

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
        """When it was tripped, on the monotonic clock [ns]."""
        return self._words[TIME]

    def trip(self, reason: str) -> None:
        """Stop; who comes first gives the reason."""
        if self:
            return
        self._text[:] = reason.encode(errors="replace")[:TEXT].ljust(TEXT, b"\0")
        self._words[TIME], self._words[PID] = time.monotonic_ns(), os.getpid()
        self._words[TRIPPED] = 1

    def clear(self) -> None:
        """Release the latch."""
        self._words[TRIPPED] = 0
