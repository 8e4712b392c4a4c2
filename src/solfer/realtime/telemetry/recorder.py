"""Records the arrays of a loop in shared memory, from which another process makes a file (`recording.py`)."""

import json
import mmap
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from solfer.middleware.shared_memory.memory.ring import Ring
from solfer.middleware.shared_memory.memory.segment import Segment

FILE, KIND = "recording", "recording"
SECONDS = 10.0
"""Duration that the memory holds [s]: a reader may hang that long, and after a crash that much is left."""


class Recorder:
    """The writing end in the loop: one record in each cycle. Never blocks, allocates nothing; overwrites old records.

    Args:
        folder: The namespace's folder.
        sources: Live arrays by name, contiguous; neither their memory nor their size changes. Sources on the same
            memory are recorded once.
        rate: Cycles per second [Hz].
        seconds: Duration that the memory holds [s].
        labels: Texts for the file beside the numbers, such as the names of joints.

    Attributes:
        size: Size of the memory [B].

    Raises:
        MiddlewareError: Another process records there, or the memory cannot be made.
    """

    def __init__(
        self,
        folder: Path,
        sources: Mapping[str, np.ndarray],
        rate: float,
        seconds: float = SECONDS,
        labels: Mapping[str, Sequence[str]] | None = None,
    ):
        same = _same(sources)
        apart = {source: array for source, array in sources.items() if source not in same}
        shapes = {source: array.shape for source, array in apart.items()}
        width, count = width_of(shapes), max(3, round(rate * seconds))
        layout = json.dumps({"columns": shapes, "same": same, "count": count, "labels": labels or {}}).encode()
        self.size = Ring.size(width, count)
        self._segment = Segment.create(folder / FILE, KIND, layout, self.size)
        # touch each page now: else the first round of the ring would do so in the loop
        np.frombuffer(self._segment.data, dtype=np.uint8)[:: mmap.PAGESIZE] = 0
        self._ring = Ring(self._segment.data, width, count)
        self._arrays = [array.reshape(-1, copy=False) for array in apart.values()]

    def record(self, time: int) -> None:
        """Record all sources at `time` [ns]."""
        np.concatenate(self._arrays, out=self._ring.values)
        self._ring.write(time)

    def close(self) -> None:
        """End the recording; records that are not drained yet are lost."""
        self._segment.close()


def width_of(shapes: Mapping[str, tuple[int, ...]]) -> int:
    """Compute the length of a record of sources with these shapes."""
    return sum(int(np.prod(shape)) for shape in shapes.values())


def _same(sources: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Find the sources on the same memory as an earlier one, and the name of that one."""
    first: dict[tuple[object, ...], str] = {}
    same = {}
    for source, array in sources.items():
        place = (array.__array_interface__["data"], array.shape) if array.size else (source,)
        if first.setdefault(place, source) != source:
            same[source] = first[place]
    return same
