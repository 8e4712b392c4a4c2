"""How long another process could have gone on, by what the kernel counts of it."""

from pathlib import Path

STOPPED = frozenset("Tt")
"""States of a process that a signal or a debugger has stopped."""


class ProcessorShare:
    """Measures how long the main thread of a process ran, or waited for something else than a processor.

    Args:
        pid: The process.
    """

    def __init__(self, pid: int):
        self._stat, self._schedule = Path(f"/proc/{pid}/stat"), Path(f"/proc/{pid}/schedstat")
        self._ran = self._read()[1]

    def since(self, elapsed: float) -> float:
        """Return how much of the time since the last call, or since the beginning, the process could have gone on [s].

        Args:
            elapsed: That time [s]; returned for a process that waits by itself, or of which the kernel counts nothing.
        """
        state, ran = self._read()
        before, self._ran = self._ran, ran
        if state in STOPPED:
            return 0.0
        return 1e-9 * (ran - before) if state == "R" else elapsed

    def _read(self) -> tuple[str, int]:
        """Return the state of the thread, see proc(5), and how long it ran [ns]; an empty state without the process."""
        try:
            state = self._stat.read_text().rpartition(")")[2].split()[0]
            return state, int(self._schedule.read_text().split()[0])
        except (OSError, ValueError, IndexError):
            return "", 0
