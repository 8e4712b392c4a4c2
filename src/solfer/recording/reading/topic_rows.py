"""The rows of the topics of a recording, of the messages in its chunks."""

import io
import struct
from collections.abc import Callable, Iterator

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel as ChannelRecord
from mcap.records import Message, Schema

from solfer.errors import RecordingError
from solfer.recording.block import CONTENT, RecordedTopic
from solfer.recording.events import event_of
from solfer.recording.kinds import EVENT_MESSAGE
from solfer.recording.model import Channel, Event
from solfer.recording.reading.mcap_records import EXPECTED, HEAD, McapRecords

Needs = Callable[[Channel], bool]
"""Decides by a channel without rows whether its numbers are needed."""

_ROW = np.dtype([("sequence", "<u4"), ("time", "<u8")])
_INDEXED = np.dtype([("time", "<u8"), ("place", "<u8")])
_MESSAGE = np.dtype([("opcode", "u1"), ("length", "<u8"), ("number", "<u2")])


class TopicRows:
    """Collects the rows and events of messages.

    Args:
        records: Where they are from.
        needs: See above; the numbers of other channels are NaN.

    Attributes:
        events: What happened.
    """

    def __init__(self, records: McapRecords, needs: Needs):
        self._records = records
        self._needs = needs
        self._schemas: dict[int, str] = {}
        self._topics: dict[int, ChannelRecord] = {}
        self._layouts: dict[int, RecordedTopic] = {}
        self._cells: dict[int, tuple[int, np.ndarray]] = {}
        self._rows: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
        self.events: list[Event] = []

    def announce(self, opcode: int, stream: ReadDataStream) -> None:
        """Take the record of a schema or of a topic."""
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas[schema.id] = schema.name.replace("/msg/", "/")
        else:
            topic = ChannelRecord.read(stream)
            self._topics[topic.id] = topic

    def take(self, messages: bytes, indices: list[bytes]) -> None:
        """Take the messages of a chunk, by the indices behind it."""
        data = np.frombuffer(messages, dtype=np.uint8)
        found = _indexed(data, indices) or _messages_of(messages)
        for number, (places, lengths) in found.items():
            if self.is_of_events(number):
                for place, length in zip(places, lengths, strict=True):
                    content = data[place + HEAD.size : place + length].tobytes()
                    message = Message.read(ReadDataStream(io.BytesIO(content)), len(content))
                    self.events.append(event_of(message.data, message.log_time))
            elif number in self._topics:
                self._take_rows(number, data, places, lengths=lengths)

    def is_of_events(self, number: int) -> bool:
        """Return whether a topic carries events, and no rows."""
        topic = self._topics.get(number)
        return topic is not None and self._schemas[topic.schema_id] == EVENT_MESSAGE

    def without_rows(self, numbers: set[int]) -> Iterator[Channel]:
        """Yield the channels of some topics, in the order of the file, without rows."""
        for number in self._topics:
            if number in numbers and not self.is_of_events(number):
                yield from self._layout(number).channels

    def channels(self) -> tuple[dict[str, Channel], int]:
        """Put the rows of each channel together; also returns how many rows the numbers of the messages lack."""
        channels: dict[str, Channel] = {}
        gaps = 0
        for number in self._topics:
            if self.is_of_events(number):
                continue
            layout = self._layout(number)
            stamps, values = self._stacked(number)
            gaps = max(gaps, _gaps(stamps["sequence"]))
            channels |= _filled(layout, 1e-9 * stamps["time"].astype(float), values)
        return channels, gaps

    def _take_rows(self, number: int, data: np.ndarray, places: np.ndarray, lengths: np.ndarray) -> None:
        """Take the messages of a topic, which begin at `places` of a chunk and are so long."""
        length, cells = self._cells_of(number)
        if np.any(lengths != length):
            what = f"messages of {self._layout(number).name} that do not have the layout of their topic"
            if what not in self._records.missing:
                self._records.missing.append(what)
            return
        rows = data[places[:, None] + cells]
        stamps = np.ascontiguousarray(rows[:, : _ROW.itemsize]).view(_ROW)[:, 0]
        values = np.ascontiguousarray(rows[:, _ROW.itemsize :]).view("<f8")
        self._rows.setdefault(number, []).append((stamps, values))

    def _cells_of(self, number: int) -> tuple[int, np.ndarray]:
        """Return the length of a topic's messages, and which of their bytes are taken: those of `_ROW` and numbers."""
        known = self._cells.get(number)
        if known is None:
            layout = self._layout(number)
            runs = layout.template.runs if any(map(self._needs, layout.channels)) else ()
            starts = [(CONTENT - 20, _ROW.itemsize), *((CONTENT + begin, 8 * count) for begin, count in runs)]
            cells = np.concatenate([np.arange(begin, begin + count) for begin, count in starts])
            known = self._cells[number] = CONTENT + len(layout.template.data), cells
        return known

    def _layout(self, number: int) -> RecordedTopic:
        """Return what the rows of a topic are.

        Raises:
            RecordingError: It does not say so.
        """
        topic = self._topics[number]
        self._records.place = f"topic {topic.topic}"
        layout = self._layouts.get(number)
        if layout is None:
            if "channels" not in topic.metadata:
                raise RecordingError("the topic does not say what its columns are", expected=EXPECTED)
            kind = self._schemas[topic.schema_id]
            layout = RecordedTopic(topic.topic[1:], (), RecordedTopic.channels_of(kind, topic.metadata))
            self._layouts[number] = layout
        return layout

    def _stacked(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return stamps and numbers of all messages of a topic, in the order of time; numbers if they are needed."""
        parts = self._rows.pop(number, [(np.zeros(0, _ROW), np.zeros((0, 0)))])
        stamps = np.concatenate([stamps for stamps, _ in parts])
        values = np.concatenate([values for _, values in parts])
        order = np.argsort(stamps["time"], kind="stable")
        return (stamps, values) if np.all(np.diff(order) == 1) else (stamps[order], values[order])


def _indexed(data: np.ndarray, indices: list[bytes]) -> dict[int, tuple[np.ndarray, np.ndarray]] | None:
    """Return what `_messages_of` does by the indices behind a chunk; None: they do not list just what it has."""
    found = {}
    whole = 0
    for content in indices:
        number, size = struct.unpack_from("<HI", content)
        places = np.frombuffer(content, _INDEXED, offset=6)["place"].astype(np.int64)
        if not len(places):
            continue
        if size != len(content) - 6 or not 0 <= places.min() <= places.max() <= len(data) - CONTENT:
            return None
        heads = data[places[:, None] + np.arange(_MESSAGE.itemsize)].view(_MESSAGE)[:, 0]
        if np.any(heads["opcode"] != Opcode.MESSAGE) or np.any(heads["number"] != number):
            return None
        lengths = HEAD.size + heads["length"].astype(np.int64)
        whole += int(lengths.sum())
        found[number] = (places, lengths)
    return found if whole == len(data) else None


def _messages_of(messages: bytes) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Find the messages of each topic in a chunk: where they begin, and how long they are."""
    found: dict[int, list[tuple[int, int]]] = {}
    place = 0
    unpack = struct.Struct("<BQH").unpack_from
    while place + CONTENT <= len(messages):
        opcode, length, number = unpack(messages, place)
        if opcode == Opcode.MESSAGE:
            found.setdefault(number, []).append((place, HEAD.size + length))
        place += HEAD.size + length
    if place != len(messages):
        raise ValueError(f"a chunk of {len(messages)} bytes with messages of {place}")
    arrays = {number: np.array(places) for number, places in found.items()}
    return {number: (places[:, 0], places[:, 1]) for number, places in arrays.items()}


def _gaps(sequence: np.ndarray) -> int:
    """Count the rows that lack between the first and the last one."""
    if len(sequence) < 2:
        return 0
    steps = np.diff(sequence)  # of 32 bits, as the numbers are: they may begin again
    return int(np.sum(steps, dtype=np.int64)) - len(steps) if np.all(steps > 0) else 0


def _filled(layout: RecordedTopic, times: np.ndarray, values: np.ndarray) -> dict[str, Channel]:
    """Return the channels of a topic with its numbers, shape (T, columns of all); without any, with NaN."""
    if not values.shape[1]:
        values = np.broadcast_to(np.nan, (len(times), sum(len(each.columns) for each in layout.channels)))
    channels = {}
    start = 0
    for each in layout.channels:
        end = start + len(each.columns)
        channels[each.name] = Channel(
            each.name,
            each.kind,
            each.columns,
            units=each.units,
            frame=each.frame,
            times=times,
            values=values[:, start:end],
            child=each.child,
        )
        start = end
    return channels
