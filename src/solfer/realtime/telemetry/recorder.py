"""Records the arrays of a loop in shared memory, from which another process makes a file (`drain.py`)."""

import json
import mmap
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from solfer.middleware.shared_memory.memory.ring import Ring
from solfer.middleware.shared_memory.memory.segment import Segment
from solfer.realtime.telemetry.row_ring import RowRing
from solfer.recording.log import LogSource
from solfer.recording.model import Event
from solfer.recording.rows import RowLayout

RECORDER_FILE = "recording"
RECORDER_KIND = "recording"
RECORDER_DURATION = 10.0
"""Duration that the memory holds [s]: a reader may hang that long, and after a crash that much is left."""

RECORDER_EVENTS, EVENT_WIDTH = 256, 64
"""Events that the memory holds, and their size in words of eight bytes; a longer text is cut."""


class Recorder:
    """The writing end in the loop: one row in each cycle. Never blocks, allocates nothing; overwrites old rows.

    Args:
        folder: The folder of the segment, such as the namespace's.
        sources: What is recorded. Sources on the same memory are recorded once.
        rate: Cycles per second [Hz].
        seconds: Duration that the memory holds [s].
        attachments: Texts that become files of the recording.
        metadata: Texts by name.

    Attributes:
        size: Size of the memory [B].
        record: `record(time)` records all sources at `time` [ns].

    Raises:
        MiddlewareError: Another process records there, or the memory cannot be made.
    """

    def __init__(
        self,
        folder: Path,
        sources: Sequence[LogSource],
        rate: float,
        seconds: float = RECORDER_DURATION,
        attachments: Mapping[str, str] | None = None,
        metadata: Mapping[str, str] | None = None,
    ):
        layout, arrays = RowLayout.of(sources, attachments or {}, metadata or {})
        count = max(3, round(rate * seconds))
        own = Ring.size(layout.width, count)
        self.size = own + Ring.size(EVENT_WIDTH, RECORDER_EVENTS)
        text = json.dumps({"rows": layout.text(), "count": count, "rate": rate}).encode()
        self._segment = Segment.create(folder / RECORDER_FILE, RECORDER_KIND, text, size=self.size)
        # touch each page now: else the first round of the ring would do so in the loop
        np.frombuffer(self._segment.data, dtype=np.uint8)[:: mmap.PAGESIZE] = 0
        self._rows, self._events = RowRing(self._segment.data, arrays, count), events_of(self._segment.data, own)
        self.record = self._rows.append

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
        """End the recording; rows that are not drained yet are lost."""
        self._segment.close()


def events_of(memory: memoryview, rows: int) -> Ring:
    """Return the ring of events in a segment, behind that of the rows, which takes so many bytes."""
    return Ring(memory[rows:], EVENT_WIDTH, RECORDER_EVENTS)
