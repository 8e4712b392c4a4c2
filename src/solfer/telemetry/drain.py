"""Takes the rows of a loop out of shared memory (`recorder.py`), for a file."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from solfer.errors import MiddlewareError
from solfer.recording.model import Event
from solfer.recording.writer import RecordingWriter
from solfer.segments.ring import Ring
from solfer.segments.segment import Segment
from solfer.telemetry.rows import RECORDING, RowLayout, events_of

BATCH = 256
"""Most rows of a chunk of the file."""


class RecordDrain:
    """The reading end: the rows since it was opened, and those that the memory still held then.

    Args:
        folder: The folder of the segment, such as the namespace's.

    Attributes:
        layout: What the rows are.
        count: Number of rows that went into a file.
        span: Times of the first and the last of them [s].

    Raises:
        MiddlewareError: There is no recorder.
    """

    def __init__(self, folder: Path):
        try:
            self._segment = Segment.attach(folder / RECORDING, RECORDING)
        except MiddlewareError as error:
            raise MiddlewareError(
                f"there is no recording: {error.what}",
                where=str(folder / RECORDING),
                expected="an RT layer in this namespace, with `record` above 0",
            ) from error
        described = json.loads(self._segment.layout)
        size = described["count"]
        self.layout = RowLayout.from_text(described["rows"])
        self.count = 0
        self.span = (0.0, 0.0)
        width = self.layout.width
        self._ring = Ring(self._segment.data, width, size)
        # rows overwritten before this do not count as lost; the oldest one may just be overwritten
        self._ring.sequence = max(0, self._ring.newest - size + 1)
        self._events = events_of(self._segment.data, Ring.size(width, size))
        self._rows = np.zeros((BATCH, width))
        self._stamps = np.zeros((2, BATCH), dtype=np.int64)

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

    def into(self, writer: RecordingWriter) -> "RecordDrain":
        """Announce the channels in a file, which `fill` fills, and return the drain itself."""
        self._writer = writer
        self._block = writer.block(self.layout.channels)
        return self

    def fill(self) -> int:
        """Write what is new to the file; return how many rows.

        Raises:
            RecordingError: The disk is full: rows that did not fit are lost, later ones may fit.
        """
        before = self.count
        for numbers, times, values in self.batches():
            self._writer.write(self._block, numbers, times, values)
        for event in self.events():
            self._writer.event(event)
        return self.count - before

    def batches(self) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Fetch new rows: their numbers, their times [ns] and the columns of all channels."""
        ring = self._ring
        number = BATCH
        while number == BATCH:
            number = 0
            while number < BATCH and ring.read():
                self._stamps[0, number] = ring.sequence
                self._stamps[1, number] = ring.stamp
                self._rows[number] = ring.values
                number += 1
            if number:
                numbers, times = self._stamps[:, :number]
                yield numbers, times, self.layout.values(self._rows[:number])
                first = self.span[0] if self.count else 1e-9 * times[0]
                self.count += number
                self.span = (first, 1e-9 * times[-1])

    def events(self) -> Iterator[Event]:
        """Fetch new events."""
        while self._events.read():
            content = self._events.values.tobytes().rstrip(b"\0")
            yield Event(1e-9 * self._events.stamp, *json.loads(content))


def writer_of(path: Path, drains: Sequence[RecordDrain]) -> RecordingWriter:
    """Make the file of some drains, with all that belongs to them; `RecordDrain.fill` fills it.

    Raises:
        RecordingError: The file cannot be made.
    """
    files = {name: text.encode() for drain in drains for name, text in drain.layout.attachments.items()}
    texts = {name: text for drain in drains for name, text in drain.layout.metadata.items()}
    writer = RecordingWriter(path, files, texts)
    for drain in drains:
        drain.into(writer)
    return writer
