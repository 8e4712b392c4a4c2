"""Reads a recording from an MCAP file, also from one whose writer was killed."""

import io
import zlib
from collections.abc import Mapping, Set
from pathlib import Path

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, Metadata

from solfer.files import open_regular
from solfer.recording.model import Recording
from solfer.recording.reading.mcap_records import McapRecords, file_named, place_named
from solfer.recording.reading.topic_rows import Needs, TopicRows
from solfer.recording.writer import END, METADATA

KINDS: Set[int] = frozenset(
    {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.ATTACHMENT, Opcode.METADATA}
    | {Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.DATA_END}
)
"""Kinds of records that a recording is made of; others repeat what these have."""

_MAX_OTHERS_SIZE = 1 << 27  # [B], of all that is no message
_MAX_UNPACKED_SIZE = 1 << 28  # [B], of all messages, and besides
_MAX_EXPANSION = 64  # times the size of the file


def read(path: Path, needs: Needs = lambda channel: True) -> Recording:
    """Read a whole file.

    Args:
        path: The file.
        needs: Decides by a channel without rows whether its numbers are needed; those of others are NaN, and take
            neither time nor memory.

    Returns:
        What it holds; where its writer came to no end, `missing` reports it, and rows that were lost on the way count.

    Raises:
        RecordingError: There is no such file, or it is no recording.
    """
    with file_named(path), open_regular(path) as file:
        records = McapRecords(file)
        with place_named(path, records):
            reader = RecordReader(records, needs)
            for _, opcode, content in records.all(KINDS):
                if opcode == Opcode.DATA_END:
                    break
                reader.take(opcode, content)
            return reader.recording()


class RecordReader:
    """Takes the records of a file, in their order. A damaged one raises what `place_named` makes a RecordingError of.

    Args:
        records: Where they are from.
        needs: See `read`.

    Attributes:
        topics: Collects rows and events.
        attachments: Files by name.
    """

    def __init__(self, records: McapRecords, needs: Needs = lambda channel: True):
        self._records = records
        self.topics = TopicRows(records, needs)
        self.attachments: dict[str, bytes] = {}
        self._texts: dict[str, Mapping[str, str]] = {}
        self._others = 0
        self._unpacked = 0
        self._messages = b""  # of the newest chunk
        self._indices: list[bytes] = []  # behind it

    def recording(self) -> Recording:
        """Put together what has been taken."""
        self.finish_chunk()
        channels, gaps = self.topics.channels()
        finished = self._texts.get(END)
        if finished is None:
            self._records.missing.append("the end: its writer was killed, or had no room; later rows are not there")
        return Recording(
            channels,
            sorted(self.topics.events, key=lambda event: event.time),
            self.attachments,
            metadata=self._texts.get(METADATA, {}),
            lost=gaps if finished is None else int(finished.get("lost", gaps)),
            missing=tuple(self._records.missing),
        )

    def take_at(self, place: int, size: int) -> None:
        """Take the records in a part of the file."""
        self._unpacked = 0
        for opcode, content in self._records.at(place, size, KINDS):
            self.take(opcode, content)
        self.finish_chunk()

    def take(self, opcode: int, content: bytes) -> None:
        """Take a record."""
        if opcode == Opcode.MESSAGE_INDEX:
            self._indices.append(content)
            return
        self.finish_chunk()
        if opcode == Opcode.CHUNK:
            self._chunk(content)
            return
        self._others += len(content)
        if self._others > _MAX_OTHERS_SIZE:
            raise ValueError(f"more than {_MAX_OTHERS_SIZE} bytes that are no messages")
        stream = ReadDataStream(io.BytesIO(content))
        if opcode == Opcode.ATTACHMENT:
            attachment = Attachment.read(stream)
            self.attachments[attachment.name] = attachment.data
        elif opcode == Opcode.METADATA:
            metadata = Metadata.read(stream)
            self._texts[metadata.name] = metadata.metadata
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self.topics.announce(opcode, stream)

    def finish_chunk(self) -> None:
        """Take the rows of the newest chunk, whose indices have been taken by now."""
        messages, indices = self._messages, self._indices
        self._messages, self._indices = b"", []
        if messages:
            self.topics.take(messages, indices)

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
            self._records.missing.append(f"damaged rows between {begin:.3f} s and {end:.3f} s")
            return
        self._unpacked += size
        if self._unpacked > _MAX_UNPACKED_SIZE + _MAX_EXPANSION * self._records.size:
            raise ValueError(f"a file of {self._records.size} bytes that unpacks to more than {self._unpacked} bytes")
        self._messages = messages
