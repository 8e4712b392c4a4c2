"""A recording of any length, of which only what is looked at is in memory."""

import io
import struct
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, MetadataIndex

from solfer.errors import RecordingError
from solfer.files import open_regular
from solfer.recording.model import Channel, Event
from solfer.recording.reader import KINDS, RecordReader
from solfer.recording.reading.mcap_records import McapRecords, file_named, place_named

_CHUNK_TIMES = struct.Struct("<QQ")
_CHUNK_INDEX = struct.Struct("<QQQQI")  # times of its first and last message, place, size, bytes of a map that follows
_NUMBER = struct.Struct("<H")
_LENGTH = struct.Struct("<Q")
_TOPIC_PLACE = np.dtype([("number", "<u2"), ("place", "<u8")])

_ChunkPlace = tuple[int, int, int, int, list[int]]
"""Times of the first and the last message of a chunk [ns], where it is, its size with its indices, and its topics."""


class RecordingPieces:
    """Reads pieces of a recording when they are looked at, and keeps the newest ones.

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
        with file_named(path):
            self._file = open_regular(path)
            self._records = McapRecords(self._file)
            try:
                with place_named(path, self._records):
                    self._survey()
            except RecordingError:
                self._file.close()
                raise
        self.begin = 1e-9 * int(self._chunks["begin"].min())
        self.end = 1e-9 * int(self._chunks["end"].max())
        self._piece = lru_cache(maxsize=32)(self._read)

    def at(self, time: float) -> Mapping[str, Channel]:
        """Return the channels with their rows around a time [s], by name; one without rows there is left out."""
        return self._piece(int((min(max(time, self.begin), self.end) - self.begin) // self.LENGTH))

    def next_events(self, most: int = 100) -> list[Event]:
        """Return so many events at most that were not returned before, in the order of time; an hour has many."""
        events = self._reader.topics.events
        events.clear()
        with file_named(self._path), place_named(self._path, self._records):
            while self._happened and len(events) < most:
                self._reader.take_at(*self._happened.pop())
        return list(events)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _read(self, number: int) -> Mapping[str, Channel]:
        """Read a piece."""
        margin = 0.25  # [s] before it, from which slow channels have their newest row at its begin
        begin = self.begin + number * self.LENGTH
        low = round(1e9 * (begin - margin))
        high = round(1e9 * (begin + self.LENGTH))
        chosen = self._chunks[(self._chunks["end"] >= low) & (self._chunks["begin"] <= high)]
        with file_named(self._path), place_named(self._path, self._records):
            for _, _, place, size in chosen.tolist():
                self._reader.take_at(place, size)
            channels, _ = self._reader.topics.channels()
        return {each.name: each for each in channels.values() if len(each.times)}

    def _survey(self) -> None:
        """Read all but the rows, and find where these are."""
        reader = self._reader = RecordReader(self._records)
        summary = self._records.summary()
        rows = list[tuple[int, int, int, int]]()
        self._happened: list[tuple[int, int]] = []  # where events are that were not read yet, the newest first
        filled: set[int] = set()
        for begin, end, place, size, numbers in self._scanned() if summary is None else self._indexed(*summary):
            filled.update(numbers)
            if reader.topics.is_of_events(numbers[0]):
                self._happened.append((place, size))
            else:
                rows.append((begin, end, place, size))
        self._happened.reverse()
        self._chunks = np.array(rows, dtype=[(name, "<i8") for name in ("begin", "end", "place", "size")])
        self.channels = tuple(reader.topics.without_rows(filled))
        self.attachments = reader.attachments
        if not self.channels or not rows:
            raise RecordingError("there are no rows", expected="a recording of a plugin that ran")

    def _indexed(self, place: int, size: int) -> Iterator[_ChunkPlace]:
        """Yield the chunks that a summary lists, and take what else it lists."""
        indices: dict[int, type[AttachmentIndex] | type[MetadataIndex]] = {
            Opcode.ATTACHMENT_INDEX: AttachmentIndex,
            Opcode.METADATA_INDEX: MetadataIndex,
        }
        for opcode, content in self._records.at(place, size, KINDS | indices.keys() | {Opcode.CHUNK_INDEX}):
            if opcode in indices:
                where = indices[opcode].read(ReadDataStream(io.BytesIO(content)))
                self._reader.take_at(where.offset, where.length)
            elif opcode == Opcode.CHUNK_INDEX:
                begin, end, chunk, length, rest = _CHUNK_INDEX.unpack_from(content)
                numbers = list(_NUMBER.unpack_from(content, _CHUNK_INDEX.size))  # events have no other
                if rest > _TOPIC_PLACE.itemsize:
                    numbers = np.frombuffer(content[_CHUNK_INDEX.size :][:rest], _TOPIC_PLACE)["number"].tolist()
                length += _LENGTH.unpack_from(content, _CHUNK_INDEX.size + rest)[0]  # of the indices behind it
                yield begin, end, chunk, length, numbers
            else:
                self._reader.take(opcode, content)

    def _scanned(self) -> Iterator[_ChunkPlace]:
        """Yield the chunks of a file without a summary, and take what else it has."""
        last: tuple[int, int, int] | None = None
        numbers: list[int] = []
        for place, opcode, content in self._records.all(KINDS):
            if opcode == Opcode.MESSAGE_INDEX:
                numbers.append(_NUMBER.unpack_from(content)[0])
                continue
            if last is not None and numbers:
                yield *last, place - last[2], numbers
            last, numbers = None, []
            if opcode == Opcode.CHUNK:
                last = (*_CHUNK_TIMES.unpack_from(content), place)
            else:
                self._reader.take(opcode, content)
        if last is not None and numbers:
            yield *last, self._records.size - last[2], numbers
