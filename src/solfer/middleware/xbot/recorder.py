"""Takes down what a loop works with, in memory of which another process makes a file (`recording.py`)."""

import json
import mmap
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from solfer.middleware.xbot.ring import Ring
from solfer.middleware.xbot.segment import Segment

FILE, KIND = "recording", "recording"
SECONDS = 10.0
"""What the memory holds: a process that drains it may hang that long, and after a crash that much is left [s]."""


class Recorder:
    """The loop's end: one record in each cycle. Never waits, allocates nothing; what is old is overwritten.

    Args:
        folder: The namespace's folder.
        sources: Live arrays by name, contiguous; neither their memory nor their size changes. Sources on the same
            memory are taken down once.
        rate: Cycles per second [Hz].
        seconds: What the memory holds [s].
        labels: Texts that a file shall have beside the numbers, such as the names of joints.

    Attributes:
        size: Memory that it takes [B].

    Raises:
        MiddlewareError: Another process records there, or the memory cannot be made.
    """

    def __init__(self, folder: Path, sources: Mapping[str, np.ndarray], rate: float, seconds: float = SECONDS,
                 labels: Mapping[str, Sequence[str]] | None = None):
        same = _same(sources)
        apart = {source: array for source, array in sources.items() if source not in same}
        shapes = {source: array.shape for source, array in apart.items()}
        width, count = width_of(shapes), max(3, round(rate * seconds))
        layout = json.dumps({"columns": shapes, "same": same, "count": count, "labels": labels or {}}).encode()
        self.size = Ring.size(width, count)
        self._segment = Segment.create(folder / FILE, KIND, layout, self.size)
        # each page is touched now: the first turn of the ring would pay for it in the loop
        np.frombuffer(self._segment.data, dtype=np.uint8)[:: mmap.PAGESIZE] = 0
        self._ring = Ring(self._segment.data, width, count)
        self._arrays = [array.reshape(-1, copy=False) for array in apart.values()]

    def take(self, time: int) -> None:
        """Take down all sources at `time` [ns]."""
        np.concatenate(self._arrays, out=self._ring.values)
        self._ring.write(time)

    def close(self) -> None:
        """End the recording; what is not drained yet is lost."""
        self._segment.close()


def width_of(shapes: Mapping[str, tuple[int, ...]]) -> int:
    """Numbers of a record whose sources have these shapes."""
    return sum(int(np.prod(shape)) for shape in shapes.values())


def _same(sources: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Sources whose memory is that of an earlier one, and the name of that."""
    first: dict[tuple[object, ...], str] = {}
    same = {}
    for source, array in sources.items():
        place = (array.__array_interface__["data"], array.shape) if array.size else (source,)
        if first.setdefault(place, source) != source:
            same[source] = first[place]
    return same
