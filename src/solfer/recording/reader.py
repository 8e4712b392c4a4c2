"""Reads a recording from an MCAP file, also from one whose writer was killed."""

import io
import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, Message, Metadata, Schema
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


def read(path: Path) -> Recording:
    """Read a whole file.

    Args:
        path: The file.

    Returns:
        What it holds; where its writer came to no end, `missing` reports it, and rows that were lost on the way count.

    Raises:
        RecordingError: There is no such file, or it is no recording.
    """
    try:
        with open_regular(path) as file:
            reader = _Reader(file)
            try:
                return reader.recording()
            except SolferError as error:
                where = ": ".join(filter(None, (str(path), reader.place, error.where)))
                raise RecordingError(error.what, where=where, expected=error.expected) from error
            except _READ_ERRORS as error:
                what = f"the recording is damaged: {described(error)}"
                raise RecordingError(what, where=f"{path}: {reader.place}", expected=_EXPECTED) from error
    except OSError as error:
        raise RecordingError(
            f"the recording cannot be read: {error.strerror}", where=str(path), expected=_EXPECTED
        ) from error


class _Reader:
    """One file; see `read`. What its records hold is only looked at: a damaged one raises one of `_READ_ERRORS`.

    Attributes:
        place: What is being read, for errors.
    """

    def __init__(self, file: BinaryIO):
        self._file = file
        self.place = ""
        self._schemas: dict[int, str] = {}
        self._topics: dict[int, ChannelRecord] = {}
        self._rows: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
        self._events: list[Event] = []
        self._attachments: dict[str, bytes] = {}
        self._texts: dict[str, Mapping[str, str]] = {}
        self._missing: list[str] = []
        self._size = os.fstat(file.fileno()).st_size
        self._others = 0
        self._unpacked = 0
        self._ended = False

    def recording(self) -> Recording:
        """Read all records, then put the numbers of each channel together."""
        if self._file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise RecordingError("this is no MCAP file", expected=_EXPECTED)
        for opcode, content in self._records():
            self._take(opcode, content)
            if opcode == Opcode.DATA_END:
                self._ended = True
                break
        channels, gaps = self._channels()
        finished = self._texts.get(END)
        if finished is None:
            self._missing.append("the end: its writer was killed, or had no room; later rows are not there")
        return Recording(
            channels,
            sorted(self._events, key=lambda event: event.time),
            self._attachments,
            metadata=self._texts.get(METADATA, {}),
            lost=gaps if finished is None else int(finished.get("lost", gaps)),
            missing=tuple(self._missing),
        )

    def _records(self) -> Iterator[tuple[int, bytes]]:
        """Yield what each record is, and its content. A part of one at the end is left out."""
        rest = self._size - len(MCAP0_MAGIC)
        while rest > 0:
            self.place = f"byte {self._file.tell()}"
            head = self._file.read(_HEAD.size)
            opcode, length = _HEAD.unpack(head.ljust(_HEAD.size, b"\0"))
            if len(head) < _HEAD.size or length > rest - _HEAD.size:
                self._missing.append(f"an unfinished record of {rest} bytes at the end")
                return
            if not opcode or length > 1 << 25:  # [B] solfer's own have some hundred kB
                raise ValueError(f"a record of the kind {opcode} with {length} bytes")
            yield opcode, self._file.read(length)
            rest -= _HEAD.size + length

    def _take(self, opcode: int, content: bytes) -> None:
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
            self._attachments[attachment.name] = attachment.data
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
        data = np.frombuffer(messages, dtype=np.uint8)
        for number, (places, lengths) in _messages_of(messages).items():
            self._messages(number, data, places, lengths=lengths)

    def _messages(self, number: int, data: np.ndarray, places: np.ndarray, lengths: np.ndarray) -> None:
        """Take the messages of a topic, which begin at `places` of a chunk and are so long."""
        topic = self._topics.get(number)
        if topic is None:
            return
        if self._schemas[topic.schema_id] == EVENT_MESSAGE:
            for place, length in zip(places, lengths, strict=True):
                content = data[place + _HEAD.size : place + length].tobytes()
                message = Message.read(ReadDataStream(io.BytesIO(content)), len(content))
                self._events.append(event_of(message.data, message.log_time))
            return
        rows = np.zeros((0, CONTENT), np.uint8)  # of unequal lengths none has the layout of the topic, see `_stacked`
        if np.all(lengths == lengths[0]):
            rows = data[places[:, None] + np.arange(int(lengths[0]))]
        stamps = np.ascontiguousarray(rows[:, CONTENT - 20 : CONTENT - 8]).view(_ROW)[:, 0]
        self._rows.setdefault(number, []).append((stamps, rows[:, CONTENT:]))

    def _channels(self) -> tuple[dict[str, Channel], int]:
        """Put the rows of each channel together; also returns how many rows the numbers of the messages lack."""
        channels: dict[str, Channel] = {}
        gaps = 0
        for number, topic in self._topics.items():
            self.place = f"topic {topic.topic}"
            kind = self._schemas[topic.schema_id]
            if kind == EVENT_MESSAGE:
                continue
            if "channels" not in topic.metadata:
                raise RecordingError("the topic does not say what its columns are", expected=_EXPECTED)
            layout = RecordedTopic(topic.topic[1:], (), RecordedTopic.channels_of(kind, topic.metadata))
            stamps, contents = self._stacked(number, layout)
            gaps = max(gaps, _gaps(stamps["sequence"]))
            channels |= _filled(layout, 1e-9 * stamps["time"].astype(float), contents)
        return channels, gaps

    def _stacked(self, number: int, layout: RecordedTopic) -> tuple[np.ndarray, np.ndarray]:
        """Return stamps and contents of all messages of a topic, in the order of time."""
        size = len(layout.template.data)
        parts = self._rows.pop(number, [])
        whole = [(stamps, contents) for stamps, contents in parts if contents.shape[1:] == (size,)]
        if len(whole) < len(parts):
            self._missing.append(f"messages of {layout.name} that do not have the layout of their topic")
        stamps = np.concatenate([np.zeros(0, _ROW), *(stamps for stamps, _ in whole)])
        contents = np.concatenate([np.zeros((0, size), np.uint8), *(contents for _, contents in whole)])
        order = np.argsort(stamps["time"], kind="stable")
        return (stamps, contents) if np.all(np.diff(order) == 1) else (stamps[order], contents[order])


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


def _filled(layout: RecordedTopic, times: np.ndarray, contents: np.ndarray) -> dict[str, Channel]:
    """Return the channels of a topic with the numbers of its messages."""
    runs = [contents[:, begin : begin + 8 * count] for begin, count in layout.template.runs]
    packed = np.ascontiguousarray(np.concatenate(runs, axis=1))
    values = packed.view("<f8").reshape(len(times), packed.shape[1] // 8)
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
