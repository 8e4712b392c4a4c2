"""Records when this machine stands still, so that a test in real time is not blamed for it.

A process of its own, since a thread of a test process also wakes up late when that one holds Python's lock. It has one
thread for each processor: a virtual machine may stop a single one.
"""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import NamedTuple

PERIOD = 0.01
"""Time between two looks at the clock [s]."""

SHORTEST = 0.05
"""Shortest delay that is recorded [s]."""

FILE = "SOLFER_TEST_STALLS"
"""Environment variable with the file of the stalls, which the processes of pytest-xdist inherit."""


class Stall(NamedTuple):
    """A time in which a processor did nothing for the tests.

    Attributes:
        begin: Monotonic time [s].
        duration: How long it lasted [s].
        processor: Number of the processor.
        steal: Time that other virtual machines had meanwhile, as the kernel counts it [s].
    """

    begin: float
    duration: float
    processor: int
    steal: float

    def __str__(self) -> str:
        return f"processor {self.processor} stood still for {self.duration:.2f} s ({self.steal:.2f} s of it stolen)"


class StallRecorder:
    """Starts the process that records stalls, and ends it."""

    def __init__(self, folder: Path):
        self._file = folder / "stalls"
        self._file.touch()
        os.environ[FILE] = str(self._file)
        self._process = subprocess.Popen(
            [sys.executable, __file__, str(self._file)], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL
        )

    def close(self) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait()


def stalls_since(begin: float, shortest: float) -> list[Stall]:
    """Return the stalls that ended after a time and were longer than another, oldest first.

    Args:
        begin: Monotonic time [s].
        shortest: Shortest duration [s].
    """
    if FILE not in os.environ:
        return []
    lines = Path(os.environ[FILE]).read_text().splitlines()
    found = []
    for line in lines:
        start, duration, processor, steal = line.split()
        stall = Stall(float(start), float(duration), int(processor), float(steal))
        if stall.begin + stall.duration > begin and stall.duration > shortest:
            found.append(stall)
    return sorted(found)


def _stolen(processor: int) -> float:
    """Return the time that other virtual machines have had of a processor [s]."""
    for line in Path("/proc/stat").read_text().splitlines():
        name, *ticks = line.split()
        if name == f"cpu{processor}":
            return int(ticks[7]) / os.sysconf("SC_CLK_TCK")
    return 0.0


def _watch(processor: int, file: int) -> None:
    os.sched_setaffinity(0, {processor})
    stolen = _stolen(processor)
    last = time.monotonic()
    while True:
        time.sleep(PERIOD)
        now = time.monotonic()
        delay = now - last - PERIOD
        if delay > SHORTEST:
            before = stolen
            stolen = _stolen(processor)
            os.write(file, f"{last} {delay} {processor} {stolen - before}\n".encode())
        last = now


def main(path: str) -> None:
    """Record stalls until stdin ends, which it also does when the tests are killed."""
    file = os.open(path, os.O_WRONLY | os.O_APPEND)
    for processor in os.sched_getaffinity(0):
        threading.Thread(target=_watch, args=(processor, file), daemon=True).start()
    sys.stdin.read()


if __name__ == "__main__":
    main(sys.argv[1])
