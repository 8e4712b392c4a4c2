"""The emergency stop of the RT layer: a latched word in shared memory."""

import os
import time
from pathlib import Path

from solfer.segments.files import PREFIX
from solfer.segments.latched import latched
from solfer.segments.words import words_of

# words of the memory
TRIPPED = 0
TRIP_TIME = 1  # [ns]
TRIP_PID = 2
ANSWER_TIME = 3  # [ns]
ANSWER_PID = 4
HOLDS = 5


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

    TEXT_SIZE = 160
    """Bytes of the reason, and of the answer; what is longer is cut off."""

    def __init__(self, folder: Path):
        layout = b"""{"words": ["tripped", "time [ns]", "pid", "answer [ns]", "answering pid", "holds"],
"texts": ["reason", "answer"]}"""
        words = 8 * 6  # [B]
        text = self.TEXT_SIZE
        self.segment = latched(folder / "estop", "estop", layout, size=words + 2 * text)
        self._words = words_of(self.segment.data[:words])
        self._text = self.segment.data[words : words + text]
        self._answer = self.segment.data[words + text : words + 2 * text]

    def __bool__(self) -> bool:
        return bool(self._words[TRIPPED])

    @property
    def reason(self) -> str:
        """Why it was tripped, and by which process; empty while it is not."""
        if not self:
            return ""
        return f"{_read(self._text)} (process {self._words[TRIP_PID]})"

    @property
    def cure(self) -> str:
        """The command that resets it, while a layer runs."""
        return f"solfer rt estop --clear --namespace {self.segment.path.parent.name.removeprefix(PREFIX)}"

    @property
    def time(self) -> int:
        """Time at which it was tripped, on the monotonic clock [ns]."""
        return self._words[TRIP_TIME]

    @property
    def answered(self) -> int:
        """Time at which an executor last held because of it, on the monotonic clock [ns]; 0: never."""
        return self._words[ANSWER_TIME]

    @property
    def answer_pid(self) -> int:
        """Process of that executor; 0: none."""
        return self._words[ANSWER_PID]

    @property
    def holds(self) -> bool:
        """Whether all plugins of that executor could hold."""
        return bool(self._words[HOLDS])

    @property
    def answer_text(self) -> str:
        """Which plugins of that executor hold, or which cannot and why; cut off at `TEXT_SIZE` bytes."""
        return _read(self._answer)

    def trip(self, reason: str) -> None:
        """Trip the latch; the first reason stays."""
        if self:
            return
        _write(self._text, reason)
        self._words[TRIP_TIME] = time.monotonic_ns()
        self._words[TRIP_PID] = os.getpid()
        self._words[TRIPPED] = 1

    def answer(self, text: str, holds: bool = True) -> None:
        """Confirm as the executor that all plugins hold, or name those that cannot."""
        _write(self._answer, text)
        self._words[ANSWER_PID] = os.getpid()
        self._words[HOLDS] = holds
        self._words[ANSWER_TIME] = time.monotonic_ns()

    def close(self) -> None:
        """Leave it to the others; tripped or not, it stays."""
        self.segment.leave()

    def clear(self) -> None:
        """Release the latch."""
        self._words[TRIPPED] = 0


def stopped(folder: Path) -> str:
    """Return why the emergency stop of a namespace's folder is tripped; empty while it is not.

    Raises:
        MiddlewareError: The folder cannot be used, or a foreign file is in the way.
    """
    return EmergencyStopLatch(folder).reason


def _read(text: memoryview) -> str:
    return bytes(text).rstrip(b"\0").decode(errors="replace")


def _write(text: memoryview, content: str) -> None:
    text[:] = content.encode(errors="replace")[: len(text)].ljust(len(text), b"\0")
