"""Reads a recording from an MCAP file, whole or in pieces, also from one whose writer was killed."""

import io
import os
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, Chunk, Footer, Message, Metadata, MetadataIndex, Schema
from mcap.records import Channel as ChannelRecord
from mcap.writer import MCAP0_MAGIC

from solfer.errors import RecordingError, SolferError, described
from solfer.files import open_regular
from solfer.recording.block import CONTENT, RecordedTopic
from solfer.recording.events import event_of
from solfer.recording.kinds import EVENT_MESSAGE
from solfer.recording.model import Channel, Event, Recording
from solfer.recording.writer import END, METADATA

_HEAD = struct.Struct("<BQ")
_MAX_OTHERS_SIZE = 1 << 27  # [B], of all that is no chunk
_MAX_UNPACKED_SIZE = 1 << 28  # [B], of all messages, and besides
_MAX_EXPANSION = 64  # times the size of the file
_EXPECTED = "a file that `solfer record` made"
_READ_ERRORS = (
    ValueError,
    TypeError,
    AttributeError,
    LookupError,
    ArithmeticError,
    RecursionError,
    struct.error,
    McapError,
)
_ROW = np.dtype([("sequence", "<u4"), ("time", "<u8")])
_INDEXED = np.dtype([("time", "<u8"), ("place", "<u8")])
_TOPIC_PLACE = np.dtype([("number", "<u2"), ("place", "<u8")])
_MESSAGE = np.dtype([("opcode", "u1"), ("length", "<u8"), ("number", "<u2")])
_CHUNK_TIMES = struct.Struct("<QQ")
_CHUNK_INDEX = struct.Struct("<QQQQI")  # times of its first and last message, place, size, bytes of a map that follows
_NUMBER = struct.Struct("<H")
_LENGTH = struct.Struct("<Q")
_FOOTER = 20  # [B]
_USED = frozenset((Opcode.SCHEMA, Opcode.CHANNEL, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.DATA_END))
_MESSAGES = frozenset((Opcode.CHUNK, Opcode.MESSAGE_INDEX))

Wanted = Callable[[Channel], bool]
"""Decides by a channel without rows whether its numbers are needed."""

_ChunkPlace = tuple[tuple[int, int], int, int, list[int]]
"""Times of the first and the last message of a chunk [ns], where it is, its size with its indices, and its topics."""


def read(path: Path, wanted: Wanted = lambda channel: True) -> Recording:
    """Read a whole file.

    Args:
        path: The file.
        wanted: See above; the numbers of other channels are NaN and take neither time nor memory.

    Returns:
        What it holds; where its writer came to no end, `missing` reports it, and rows that were lost on the way count.

    Raises:
        RecordingError: There is no such file, or it is no recording.
    """
    with _named(path), open_regular(path) as file:
        reader = _Reader(file, wanted)
        with _placed(path, reader):
            return reader.recording()


class RecordingPieces:
    """A recording of any length, of which only pieces of some seconds are in memory.

    Args:
        path: The file.

    Attributes:
        channels: Those that have rows, without them.
        begin, end: Times of the first and the last row [s].
        attachments: Files by name.

    Raises:
        RecordingError: There is no such file, it is no recording, or it has no rows.
    """

    LENGTH = 1.0
    """Length of a piece [s]."""

    def __init__(self, path: Path):
        self._path = path
        with _named(path):
            self._file = open_regular(path)
            self._reader = _Reader(self._file)
            try:
                with _placed(path, self._reader):
                    self._chunks = self._reader.survey()
                    self.channels = tuple(self._reader.without_rows())
                    if not self.channels:
                        raise RecordingError("there are no rows", expected="a recording of a plugin that ran")
            except RecordingError:
                self._file.close()
                raise
        self.attachments = self._reader.attachments
        self.begin = 1e-9 * int(self._chunks["begin"].min())
        self.end = 1e-9 * int(self._chunks["end"].max())
        self._piece = lru_cache(maxsize=32)(self._read)

    def at(self, time: float) -> Mapping[str, Channel]:
        """Return the channels with their rows around a time [s], by name; one without rows there is left out."""
        return self._piece(int((min(max(time, self.begin), self.end) - self.begin) // self.LENGTH))

    def next_events(self, most: int = 100) -> list[Event]:
        """Return so many events at most that were not returned before, in the order of time; an hour has many."""
        with _named(self._path), _placed(self._path, self._reader):
            return self._reader.next_events(most)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _read(self, number: int) -> Mapping[str, Channel]:
        margin = 0.25  # [s] before it, from which slow channels have their newest row at its begin
        begin = self.begin + number * self.LENGTH
        low = round(1e9 * (begin - margin))
        high = round(1e9 * (begin + self.LENGTH))
        chosen = self._chunks[(self._chunks["end"] >= low) & (self._chunks["begin"] <= high)]
        with _named(self._path), _placed(self._path, self._reader):
            channels = self._reader.channels_of(chosen)
        return {each.name: each for each in channels.values() if len(each.times)}


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name the file that the system does not read."""
    try:
        yield
    except OSError as error:
        raise RecordingError(
            f"the recording cannot be read: {error.strerror}", where=str(path), expected=_EXPECTED
        ) from error


@contextmanager
def _placed(path: Path, reader: "_Reader") -> Iterator[None]:
    """Name the place at which a file is damaged."""
    try:
        yield
    except SolferError as error:
        where = ": ".join(filter(None, (str(path), reader.place, error.where)))
        raise RecordingError(error.what, where=where, expected=error.expected) from error
    except _READ_ERRORS as error:
        what = f"the recording is damaged: {described(error)}"
        raise RecordingError(what, where=f"{path}: {reader.place}", expected=_EXPECTED) from error


class _Reader:
    """One file; see `read`. What its records hold is only looked at: a damaged one raises one of `_READ_ERRORS`.

    Attributes:
        place: What is being read, for errors.
        events: What happened.
        attachments: Files by name.
    """

    def __init__(self, file: BinaryIO, wanted: Wanted = lambda channel: True):
        self._file = file
        self._wanted = wanted
        self.place = ""
        self._schemas: dict[int, str] = {}
        self._topics: dict[int, ChannelRecord] = {}
        self._rows: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
        self.events: list[Event] = []
        self.attachments: dict[str, bytes] = {}
        self._texts: dict[str, Mapping[str, str]] = {}
        self._missing: list[str] = []
        self._size = os.fstat(file.fileno()).st_size
        self._others = 0
        self._unpacked = 0
        self._messages = b""  # of the newest chunk
        self._indices: list[bytes] = []  # behind it
        self._filled: set[int] = set()  # numbers of topics that have rows
        self._happened: list[tuple[int, int]] = []  # where events are that were not read yet, the newest first
        self._layouts: dict[int, RecordedTopic] = {}
        self._taken: dict[int, tuple[int, np.ndarray]] = {}

    def recording(self) -> Recording:
        """Read all records, then put the numbers of each channel together."""
        self._begin()
        for opcode, content in self._records(self._file, self._size - len(MCAP0_MAGIC), _USED | _MESSAGES):
            self._take(opcode, content)
            if opcode == Opcode.DATA_END:
                break
        channels, gaps = self._channels()
        finished = self._texts.get(END)
        if finished is None:
            self._missing.append("the end: its writer was killed, or had no room; later rows are not there")
        return Recording(
            channels,
            sorted(self.events, key=lambda event: event.time),
            self.attachments,
            metadata=self._texts.get(METADATA, {}),
            lost=gaps if finished is None else int(finished.get("lost", gaps)),
            missing=tuple(self._missing),
        )

    def survey(self) -> np.ndarray:
        """Read all but the rows; return where chunks of rows are, in the order of the file, shape (chunks,)."""
        self._begin()
        summary = self._summary()
        found = list[tuple[int, int, int, int]]()
        for times, place, size, numbers in self._indexed_chunks(summary) if summary else self._scanned_chunks():
            self._filled.update(numbers)
            if self._is_of_events(numbers[0]):
                self._happened.append((place, size))
            else:
                found.append((*times, place, size))
        self._happened.reverse()
        names = ("begin", "end", "place", "size")
        return np.array(found, dtype=[(name, "<i8") for name in names])

    def next_events(self, most: int) -> list[Event]:
        """Read so many more events at most, after `survey`."""
        self.events.clear()
        while self._happened and len(self.events) < most:
            self._take_at(*self._happened.pop())
        return list(self.events)

    def without_rows(self) -> Iterator[Channel]:
        """Yield the channels that have rows, after `survey`."""
        for number in self._filled:
            if number in self._topics and not self._is_of_events(number):
                yield from self._layout(number).channels

    def channels_of(self, chunks: np.ndarray) -> dict[str, Channel]:
        """Return the channels with the rows of some chunks of `survey` alone."""
        self._unpacked = 0
        for place, size in zip(chunks["place"].tolist(), chunks["size"].tolist(), strict=True):
            self._take_at(place, size)
        return self._channels()[0]

    def _begin(self) -> None:
        if self._file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise RecordingError("this is no MCAP file", expected=_EXPECTED)

    def _summary(self) -> bytes:
        """Return the part of a finished file that says what is where; empty: its writer did not come to its end."""
        footer = _HEAD.size + _FOOTER
        end = self._size - footer - len(MCAP0_MAGIC)
        if end < len(MCAP0_MAGIC):
            return b""
        self._file.seek(end)
        tail = self._file.read(footer + len(MCAP0_MAGIC))
        if tail[0] != Opcode.FOOTER or tail[footer:] != MCAP0_MAGIC:
            self._file.seek(len(MCAP0_MAGIC))
            return b""
        begin = Footer.read(ReadDataStream(io.BytesIO(tail[_HEAD.size :]))).summary_start
        if not len(MCAP0_MAGIC) <= begin <= end:
            raise ValueError(f"a summary at byte {begin} of {self._size}")
        self._file.seek(begin)
        return self._file.read(end - begin)

    def _indexed_chunks(self, summary: bytes) -> Iterator[_ChunkPlace]:
        """Yield the chunks that a summary lists, and take what else it lists."""
        wanted = _USED | {Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX}
        for opcode, content in self._records(io.BytesIO(summary), len(summary), wanted):
            if opcode in (Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX):
                index = AttachmentIndex if opcode == Opcode.ATTACHMENT_INDEX else MetadataIndex
                where = index.read(ReadDataStream(io.BytesIO(content)))
                self._take_at(where.offset, where.length)
            elif opcode == Opcode.CHUNK_INDEX:
                begin, end, place, size, rest = _CHUNK_INDEX.unpack_from(content)
                numbers = list(_NUMBER.unpack_from(content, _CHUNK_INDEX.size))  # events have no other
                if rest > _TOPIC_PLACE.itemsize:
                    numbers = np.frombuffer(content[_CHUNK_INDEX.size :][:rest], _TOPIC_PLACE)["number"].tolist()
                size += _LENGTH.unpack_from(content, _CHUNK_INDEX.size + rest)[0]  # of the indices behind it
                yield (begin, end), place, size, numbers
            else:
                self._take(opcode, content)

    def _scanned_chunks(self) -> Iterator[_ChunkPlace]:
        """Yield the chunks of a file without a summary, and take what else it has."""
        last: tuple[tuple[int, int], int] | None = None
        numbers: list[int] = []
        place = self._file.tell()
        for opcode, content in self._records(self._file, self._size - place, _USED | _MESSAGES):
            if opcode == Opcode.MESSAGE_INDEX:
                numbers.append(_NUMBER.unpack_from(content)[0])
            elif last is not None:
                yield *last, place - last[1], numbers
                last, numbers = None, []
            if opcode == Opcode.CHUNK:
                last = _CHUNK_TIMES.unpack_from(content), place
            elif opcode in _USED:
                self._take(opcode, content)
            place = self._file.tell()
        if last is not None:
            yield *last, place - last[1], numbers

    def _take_at(self, place: int, size: int) -> None:
        """Take the records at a place of the file."""
        if place + size > self._size:
            raise ValueError(f"{size} bytes at byte {place} of {self._size}")
        self._file.seek(place)
        content = io.BytesIO(self._file.read(size))
        for opcode, record in self._records(content, size, _USED | _MESSAGES):
            self._take(opcode, record)
        self._put_apart()

    def _records(self, file: BinaryIO, rest: int, wanted: Set[int]) -> Iterator[tuple[int, bytes]]:
        """Yield what each record is, and its content, of those kinds. A part of one at the end is left out."""
        while rest > 0:
            self.place = f"byte {file.tell()}"
            head = file.read(_HEAD.size)
            opcode, length = _HEAD.unpack(head.ljust(_HEAD.size, b"\0"))
            if len(head) < _HEAD.size or length > rest - _HEAD.size:
                self._missing.append(f"an unfinished record of {rest} bytes at the end")
                return
            if not opcode or length > 1 << 25:  # [B] solfer's own have some hundred kB
                raise ValueError(f"a record of the kind {opcode} with {length} bytes")
            if opcode in wanted:
                yield opcode, file.read(length)
            else:
                file.seek(length, os.SEEK_CUR)
            rest -= _HEAD.size + length

    def _take(self, opcode: int, content: bytes) -> None:
        if opcode == Opcode.MESSAGE_INDEX:
            self._indices.append(content)
            return
        self._put_apart()
        if opcode == Opcode.CHUNK:
            self._chunk(content)
            return
        self._others += len(content)
        if self._others > _MAX_OTHERS_SIZE:
            raise ValueError(f"more than {_MAX_OTHERS_SIZE} bytes that are no messages")
        stream = ReadDataStream(io.BytesIO(content))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas[schema.id] = schema.name.replace("/msg/", "/")
        elif opcode == Opcode.CHANNEL:
            topic = ChannelRecord.read(stream)
            self._topics[topic.id] = topic
        elif opcode == Opcode.ATTACHMENT:
            attachment = Attachment.read(stream)
            self.attachments[attachment.name] = attachment.data
        elif opcode == Opcode.METADATA:
            metadata = Metadata.read(stream)
            self._texts[metadata.name] = metadata.metadata

    def _chunk(self, content: bytes) -> None:
        """Take the messages of a chunk; one that is damaged is left out."""
        chunk = Chunk.read(ReadDataStream(io.BytesIO(content)))
        packing = chunk.compression
        size = chunk.uncompressed_size
        checksum = chunk.uncompressed_crc
        try:
            most = 1 << 24  # [B] of the messages in a chunk; solfer's own have some hundred kB
            if size > most or (packing == "zstd" and zstandard.frame_content_size(chunk.data) not in (-1, size)):
                raise zstandard.ZstdError("as much memory would be taken as a damaged number says")
            messages = zstandard.decompress(chunk.data, size) if packing == "zstd" else chunk.data
        except zstandard.ZstdError:
            messages = b""
        if packing not in ("", "zstd") or len(messages) != size or (checksum and zlib.crc32(messages) != checksum):
            begin = 1e-9 * chunk.message_start_time
            end = 1e-9 * chunk.message_end_time
            self._missing.append(f"damaged rows between {begin:.3f} s and {end:.3f} s")
            return
        self._unpacked += size
        if self._unpacked > _MAX_UNPACKED_SIZE + _MAX_EXPANSION * self._size:
            raise ValueError(f"a file of {self._size} bytes that unpacks to more than {self._unpacked} bytes")
        self._messages = messages

    def _put_apart(self) -> None:
        """Take the rows of the newest chunk, whose indices have been read by now."""
        messages, indices = self._messages, self._indices
        self._messages, self._indices = b"", []
        if messages:
            data = np.frombuffer(messages, dtype=np.uint8)
            found = _indexed(data, indices) or _messages_of(messages)
            for number, (places, lengths) in found.items():
                self._take_messages(number, data, places, lengths=lengths)

    def _take_messages(self, number: int, data: np.ndarray, places: np.ndarray, lengths: np.ndarray) -> None:
        """Take the messages of a topic, which begin at `places` of a chunk and are so long."""
        topic = self._topics.get(number)
        if topic is None:
            return
        if self._is_of_events(number):
            for place, length in zip(places, lengths, strict=True):
                content = data[place + _HEAD.size : place + length].tobytes()
                message = Message.read(ReadDataStream(io.BytesIO(content)), len(content))
                self.events.append(event_of(message.data, message.log_time))
            return
        length, cells = self._cells(number)
        if np.any(lengths != length):
            what = f"messages of {self._layout(number).name} that do not have the layout of their topic"
            if what not in self._missing:
                self._missing.append(what)
            return
        rows = data[places[:, None] + cells]
        stamps = np.ascontiguousarray(rows[:, : _ROW.itemsize]).view(_ROW)[:, 0]
        values = np.ascontiguousarray(rows[:, _ROW.itemsize :]).view("<f8")
        self._rows.setdefault(number, []).append((stamps, values))

    def _cells(self, number: int) -> tuple[int, np.ndarray]:
        """Return the length of a topic's messages, and which of their bytes are taken: those of `_ROW` and numbers."""
        known = self._taken.get(number)
        if known is None:
            found = self._layout(number).template
            runs = found.runs if any(map(self._wanted, self._layout(number).channels)) else ()
            starts = [(CONTENT - 20, _ROW.itemsize), *((CONTENT + begin, 8 * count) for begin, count in runs)]
            cells = np.concatenate([np.arange(begin, begin + count) for begin, count in starts])
            known = self._taken[number] = CONTENT + len(found.data), cells
        return known

    def _channels(self) -> tuple[dict[str, Channel], int]:
        """Put the rows of each channel together; also returns how many rows the numbers of the messages lack."""
        channels: dict[str, Channel] = {}
        gaps = 0
        self._put_apart()
        for number in self._topics:
            self.place = f"topic {self._topics[number].topic}"
            if self._is_of_events(number):
                continue
            layout = self._layout(number)
            stamps, values = self._stacked(number)
            gaps = max(gaps, _gaps(stamps["sequence"]))
            channels |= _filled(layout, 1e-9 * stamps["time"].astype(float), values)
        return channels, gaps

    def _is_of_events(self, number: int) -> bool:
        """Return whether a topic carries events, and no rows."""
        topic = self._topics.get(number)
        return topic is not None and self._schemas[topic.schema_id] == EVENT_MESSAGE

    def _layout(self, number: int) -> RecordedTopic:
        """Return what the rows of a topic are.

        Raises:
            RecordingError: It does not say so.
        """
        layout = self._layouts.get(number)
        if layout is None:
            topic = self._topics[number]
            self.place = f"topic {topic.topic}"
            if "channels" not in topic.metadata:
                raise RecordingError("the topic does not say what its columns are", expected=_EXPECTED)
            kind = self._schemas[topic.schema_id]
            layout = RecordedTopic(topic.topic[1:], (), RecordedTopic.channels_of(kind, topic.metadata))
            self._layouts[number] = layout
        return layout

    def _stacked(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return stamps and numbers of all messages of a topic, in the order of time; numbers if they are wanted."""
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
        lengths = _HEAD.size + heads["length"].astype(np.int64)
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
            found.setdefault(number, []).append((place, _HEAD.size + length))
        place += _HEAD.size + length
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
