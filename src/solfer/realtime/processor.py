"""How long processes could have gone on, by what the kernel counts of them; see proc(5)."""

import os
import signal
import sys
from pathlib import Path
from types import FrameType


class ProcessorTime:
    """Measures how long the main thread of another process ran, or waited for something else than a processor.

    Args:
        pid: The process.
    """

    def __init__(self, pid: int):
        self._stat = Path(f"/proc/{pid}/stat")
        self._schedule = Path(f"/proc/{pid}/schedstat")
        self._ran = self._read()[1]

    def since(self, elapsed: float) -> float:
        """Return how much of the time since the last call, or since the beginning, the process could have gone on [s].

        Args:
            elapsed: That time [s]; returned for a process that waits by itself, or of which the kernel counts nothing.
        """
        state, ran = self._read()
        before = self._ran
        self._ran = ran
        if state in ("T", "t"):  # stopped by a signal or a debugger
            return 0.0
        return 1e-9 * (ran - before) if state == "R" else elapsed

    def _read(self) -> tuple[str, int]:
        """Return the state of the thread, and how long it ran [ns]; an empty state without the process."""
        try:
            state = self._stat.read_text().rpartition(")")[2].split()[0]
            return state, int(self._schedule.read_text().split()[0])
        except (OSError, ValueError, IndexError):
            return "", 0


class Interruptions:
    """Measures how long the main thread of this process was kept from running in a cycle of its loop.

    It waited for a processor, or a signal had stopped the process. A call that blocks is no interruption.
    """

    def __init__(self) -> None:
        self._file = os.open("/proc/self/schedstat", os.O_RDONLY | os.O_CLOEXEC)
        self._waited = self._read()
        self._time = 0
        self._is_known = self._was_stopped = False
        self._before = signal.signal(signal.SIGCONT, self._on_continue)

    def start(self) -> None:
        """Begin with a cycle."""
        self._is_known = False

    def in_cycle(self) -> int:
        """Return for how long it was interrupted in this cycle [ns]; one that was stopped for any time."""
        if not self._is_known:
            waited = self._read()
            self._time = sys.maxsize if self._was_stopped else waited - self._waited
            self._waited = waited
            self._was_stopped = False
            self._is_known = True
        return self._time

    def close(self) -> None:
        """Restore the earlier signal handler."""
        signal.signal(signal.SIGCONT, self._before)
        os.close(self._file)

    def _on_continue(self, number: int, frame: FrameType | None) -> None:
        self._was_stopped = True

    def _read(self) -> int:
        """Return how long the thread has waited for a processor since it began [ns]."""
        return int(os.pread(self._file, 64, 0).split()[1])
