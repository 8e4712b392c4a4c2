"""Takes the rows of a loop out of shared memory (`recorder.py`), for a file."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.memory.ring import Ring
from solfer.middleware.shared_memory.memory.segment import Segment
from solfer.realtime.telemetry.recorder import RECORDER_FILE, RECORDER_KIND, events_of
from solfer.recording.model import Event
from solfer.recording.rows import RowLayout
from solfer.recording.writer import RecordingWriter

BATCH = 256
"""Most rows of a chunk of the file."""


class RecordDrain:
    """The reading end: the rows since it was opened, and those that the memory still held then.

    Args:
        folder: The folder of the segment, such as the namespace's.

    Attributes:
        layout: What the rows are.
        rate: Cycles of the loop per second [Hz].
        count: Number of rows that went into a file.
        span: Times of the first and the last of them [s].

    Raises:
        MiddlewareError: There is no recorder.
    """

    def __init__(self, folder: Path):
        try:
            self._segment = Segment.attach(folder / RECORDER_FILE, RECORDER_KIND)
        except MiddlewareError as error:
            raise MiddlewareError(
                f"there is no recording: {error.what}",
                where=str(folder / RECORDER_FILE),
                expected="an RT layer in this namespace, with `record` above 0",
            ) from error
        described = json.loads(self._segment.layout)
        whole = RowLayout.from_text(described["rows"])
        size = described["count"]
        self.rate = described["rate"]
        self.layout = whole
        self.count = 0
        self.span = (0.0, 0.0)
        self._ring = Ring(self._segment.data, whole.width, size)
        # rows overwritten before this do not count as lost; the oldest one may just be overwritten
        self._ring.sequence = max(0, self._ring.newest - size + 1)
        self._events = events_of(self._segment.data, Ring.size(whole.width, size))
        self._rows = np.zeros((BATCH, whole.width))
        self._numbers = np.zeros(BATCH, dtype=np.int64)
        self._times = np.zeros(BATCH, dtype=np.int64)

    @property
    def lost(self) -> int:
        """Number of rows that were overwritten before they were drained."""
        return self._ring.lost

    @property
    def over(self) -> bool:
        """Whether the recording process has ended, in good order or not."""
        return not self._segment.owned()

    @property
    def plugins(self) -> tuple[str, ...]:
        """Names of the plugins that are recorded."""
        return tuple(dict.fromkeys(each.name.partition("/")[0] for each in self.layout.channels))

    def only(self, plugins: Sequence[str]) -> "RecordDrain":
        """Leave out what belongs to other plugins, and return the drain itself."""
        self.layout = self.layout.only(plugins)
        return self

    def skip(self) -> None:
        """Leave out the rows in the memory: the recording begins now."""
        self._ring.skip()
        self._events.skip()

    def into(self, writer: RecordingWriter) -> "FileDrain":
        """Announce the channels in a file, and return what fills it."""
        return FileDrain(self, writer)

    def batches(self) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Fetch new rows: their numbers, their times [ns] and the columns of all channels."""
        number = BATCH
        while number == BATCH:
            number = self._fetch()
            if number:
                times = self._times[:number]
                yield self._numbers[:number], times, self.layout.values(self._rows[:number])
                first = self.span[0] if self.count else 1e-9 * times[0]
                self.count = self.count + number
                self.span = (first, 1e-9 * times[-1])

    def events(self) -> Iterator[Event]:
        """Fetch new events."""
        while self._events.read():
            content = self._events.values.tobytes().rstrip(b"\0")
            yield Event(1e-9 * self._events.stamp, *json.loads(content))

    def _fetch(self) -> int:
        """Fetch at most one batch; return how many rows it has."""
        ring = self._ring
        for place in range(BATCH):
            if not ring.read():
                return place
            self._numbers[place], self._times[place], self._rows[place] = ring.sequence, ring.stamp, ring.values
        return BATCH


class FileDrain:
    """Fills a file from a drain.

    Args:
        drain: The drain.
        writer: The file.
    """

    def __init__(self, drain: RecordDrain, writer: RecordingWriter):
        self.drain, self._writer, self._block = drain, writer, writer.block(drain.layout.channels)

    def fill(self) -> int:
        """Write what is new; return how many rows.

        Raises:
            RecordingError: The disk is full: rows that did not fit are lost, later ones may fit.
        """
        before = self.drain.count
        for numbers, times, values in self.drain.batches():
            self._writer.write(self._block, numbers, times, values)
        for event in self.drain.events():
            self._writer.event(event)
        return self.drain.count - before
