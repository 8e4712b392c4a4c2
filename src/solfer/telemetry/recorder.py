"""Records the arrays of a loop in shared memory, from which another process makes a file (`drain.py`)."""

import json
import mmap
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from solfer.numerics.blocks import MemoryBlock
from solfer.recording.log import LogSource
from solfer.recording.model import Event
from solfer.segments.header import CACHE_LINE
from solfer.segments.ring import Ring
from solfer.segments.segment import Segment
from solfer.telemetry.kernel import ROW_RING, append
from solfer.telemetry.rows import EVENT_COUNT, EVENT_WIDTH, RECORDING, RowLayout, events_of

DURATION = 10.0
"""Duration that the memory holds [s]: a reader may hang that long, and after a crash that much is left."""


class Recorder:
    """The writing end in the loop: one row in each cycle. Never blocks, allocates nothing; overwrites old rows.

    To gather a row here and not in `Ring.values`, without a word of Python in between, takes a third of the time where
    the processor has to fetch code and numbers again, as in a loop that sleeps between its cycles.

    Args:
        folder: The folder of the segment, such as the namespace's.
        sources: What is recorded. Sources on the same memory are recorded once.
        rate: Cycles per second [Hz].
        seconds: Duration that the memory holds [s].
        attachments: Texts that become files of the recording.
        metadata: Texts by name.

    Attributes:
        size: Size of the memory [B].

    Raises:
        MiddlewareError: Another process records there, or the memory cannot be made.
    """

    def __init__(
        self,
        folder: Path,
        sources: Sequence[LogSource],
        rate: float,
        seconds: float = DURATION,
        attachments: Mapping[str, str] | None = None,
        *,
        metadata: Mapping[str, str] | None = None,
    ):
        layout, arrays = RowLayout.of(sources, attachments or {}, metadata or {})
        count = max(3, round(rate * seconds))
        own = Ring.size(layout.width, count)
        self.size = own + Ring.size(EVENT_WIDTH, EVENT_COUNT)
        text = json.dumps({"rows": layout.text(), "count": count, "rate": rate}).encode()
        self._segment = Segment.create(folder / RECORDING, RECORDING, text, size=self.size)
        # touch each page now: else the first round of the ring would do so in the loop
        np.frombuffer(self._segment.data, dtype=np.uint8)[:: mmap.PAGESIZE] = 0
        self._events = events_of(self._segment.data, own)
        self._arrays = [array for array in arrays if array.size]  # they live as long as the ring
        words = np.frombuffer(self._segment.data[:own], dtype=np.int64)
        self._block = MemoryBlock(
            ROW_RING,
            arrays=np.array([array.ctypes.data for array in self._arrays], dtype=np.int64),
            sizes=np.array([array.size for array in self._arrays], dtype=np.int64),
            pieces=len(self._arrays),
            words=words,
            size=words.size,
            count=count,
            stride=(own - CACHE_LINE) // (8 * count),
            number=np.zeros(1, dtype=np.int64),
        )
        self._address = self._block.address

    def append(self, time: int) -> None:
        """Record all sources as they are at `time` [ns], over the oldest row."""
        append(self._address, time)

    def event(self, event: Event) -> None:
        """Record an event; its text may be cut."""
        text = event.text
        while len(content := json.dumps([event.plugin, event.kind, text]).encode()) > 8 * EVENT_WIDTH:
            text = text[: len(text) * 3 // 4]
        words = self._events.values.view(np.uint8)
        words[:] = 0
        words[: len(content)] = np.frombuffer(content, dtype=np.uint8)
        self._events.write(round(1e9 * event.time))

    def close(self) -> None:
        """Remove the recording. A process that ends without this leaves its last seconds to readers."""
        self._segment.close()
