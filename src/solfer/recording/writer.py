"""Writes a recording as an MCAP file, chunk by chunk: what is written stays readable whatever happens to the writer."""

import json
import os
import struct
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.records import Channel as ChannelRecord
from mcap.writer import MCAP0_MAGIC

from solfer.errors import RecordingError
from solfer.recording.block import Block, together
from solfer.recording.events import event_message
from solfer.recording.kinds import EVENT_MESSAGE, check, definition, ros_name
from solfer.recording.model import Channel, Event, Recording

METADATA = "solfer"
"""Name of the texts at the beginning."""

END = "solfer_end"
"""Name of the texts that only a file has whose writer came to its end."""

_INFINITE_DURATION = {"sec": 9223372036, "nsec": 854775807}
_QOS = json.dumps(
    [
        {
            "history": 1,  # keep the last ones
            "depth": 10,
            "reliability": 1,  # reliable
            "durability": 2,  # volatile
            "deadline": _INFINITE_DURATION,
            "lifespan": _INFINITE_DURATION,
            "liveliness": 1,  # automatic
            "liveliness_lease_duration": _INFINITE_DURATION,
            "avoid_ros_namespace_conventions": False,
        }
    ]
)
"""Quality of service of each topic, as `ros2 bag` writes it, which the profile `ros2` of MCAP requests: YAML."""


class RecordingWriter:
    """A file that grows. What it holds is on the disk after each call, as whole chunks.

    Args:
        path: The file; an earlier one is replaced.
        attachments: Files to put into it, by name.
        metadata: Texts to put into it, by name.

    Attributes:
        path: See above.
        size: Bytes so far.
        rows: Number of rows that were written.
        dropped: Number of rows that could not be written.

    Raises:
        RecordingError: The file cannot be made.
    """

    def __init__(
        self, path: Path, attachments: Mapping[str, bytes] | None = None, metadata: Mapping[str, str] | None = None
    ):
        self.path = Path(path)
        self.size = 0
        self.rows = 0
        self.dropped = 0
        # the fastest level that is worth it
        self._compress = zstandard.ZstdCompressor(level=1).compress
        self._schemas: dict[str, Schema] = {}
        self._channels: list[ChannelRecord] = []
        self._chunks: list[bytes] = []  # their indices, already written down: an hour has many
        self._span = (0, 0)
        self._attached: list[AttachmentIndex] = []
        self._texts: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        try:
            self.path.unlink(missing_ok=True)  # neither through a link nor into a file that another process reads
            self._file = self.path.open("xb", buffering=0)
        except OSError as error:
            raise _cannot_write(error, self.path) from error
        self._append(MCAP0_MAGIC + _bytes(Header("ros2", "solfer")))
        self._text(METADATA, dict(metadata or {}))
        for name, data in (attachments or {}).items():
            self._attach(name, data)
        self._events = self._channel(EVENT_MESSAGE, "/events", {})

    def block(self, channels: Sequence[Channel]) -> Block:
        """Announce channels that are recorded together; their own times and values do not count.

        Raises:
            UnknownName: A kind of channel does not exist.
            RecordingError: A channel does not fit its kind, or the file cannot be written.
        """
        for channel in channels:
            check(channel)
        block = Block(channels, len(self._channels) + 1)
        for topic in block.topics:
            self._channel(topic.kind, f"/{topic.name}", topic.described())
        return block

    def write(self, block: Block, numbers: np.ndarray, times: np.ndarray, values: np.ndarray) -> None:
        """Append rows of a block: all or none.

        Args:
            block: What `block` returned.
            numbers: Numbers of the rows, from 1 on: gaps are rows that were lost; int64, shape (T,).
            times: Their times, ascending, int64, shape (T,) [ns].
            values: Their numbers, float64, shape (T, block.width).

        Raises:
            RecordingError: The disk is full: these rows are dropped, later ones may fit.
        """
        if not len(times):
            return
        messages = block.messages(numbers, times, values)
        offsets = block.offsets(len(times))
        index = np.empty((*offsets.shape, 2), dtype="<u8")
        index[..., 0] = times
        index[..., 1] = offsets
        try:
            self._chunk(messages.tobytes(), block.first, index)
        except RecordingError:
            self.dropped += len(times)
            raise
        self.rows += len(times)

    def event(self, event: Event) -> None:
        """Append an event.

        Raises:
            RecordingError: The disk is full.
        """
        time = round(1e9 * event.time)
        message = Message(self._events, time, event_message(event, time), publish_time=time, sequence=0)
        self._chunk(_bytes(message), self._events, np.array([[[time, 0]]], dtype="<u8"))

    def finish(self, lost: int = 0) -> None:
        """Complete the file, which had to do without `lost` rows, with the index of all, and close it.

        Raises:
            RecordingError: There is no room for that; all else can be read.
        """
        try:
            self._text(END, {"lost": str(lost + self.dropped)})
            self._append(self._summary())
        finally:
            self._file.close()

    def close(self) -> None:
        """Close the file as it is."""
        self._file.close()

    def _channel(self, kind: str, topic: str, metadata: dict[str, str]) -> int:
        """Announce a topic; returns its number."""
        schema = self._schemas.get(kind)
        records: list[McapRecord] = []
        if schema is None:
            schema = Schema(len(self._schemas) + 1, definition(kind).encode(), "ros2msg", ros_name(kind))
            records.append(schema)
        texts = metadata | {"offered_qos_profiles": _QOS}
        channel = ChannelRecord(len(self._channels) + 1, topic, "cdr", texts, schema.id)
        self._append(b"".join(map(_bytes, (*records, channel))))
        self._schemas[kind] = schema
        self._channels.append(channel)
        return channel.id

    def _text(self, name: str, texts: dict[str, str]) -> None:
        data = _bytes(Metadata(name, texts))
        self._texts.append(MetadataIndex(self._append(data), len(data), name))

    def _attach(self, name: str, content: bytes) -> None:
        kinds = {".urdf": "application/xml", ".srdf": "application/xml", ".yaml": "application/yaml"}
        media = kinds.get(Path(name).suffix, "application/octet-stream")
        data = _bytes(Attachment(0, 0, name, media, content))
        begin = self._append(data)
        self._attached.append(
            AttachmentIndex(begin, len(data), 0, create_time=0, data_size=len(content), name=name, media_type=media)
        )

    def _chunk(self, messages: bytes, first: int, index: np.ndarray) -> None:
        """Append a chunk with messages of topics from `first` on; `index`: their times and places, (topics, T, 2)."""
        packed = self._compress(messages)
        begin = int(index[..., 0].min())
        end = int(index[..., 0].max())
        size = len(messages)
        checksum = zlib.crc32(messages)
        chunk = _bytes(
            Chunk("zstd", packed, end, message_start_time=begin, uncompressed_crc=checksum, uncompressed_size=size)
        )
        tail = bytearray()
        places = {}
        start = self.size
        for number, rows in enumerate(index, start=first):
            places[number] = start + len(chunk) + len(tail)
            tail += struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + rows.nbytes, number, rows.nbytes) + rows.tobytes()
        self._append(chunk + tail)
        entry = ChunkIndex(
            len(chunk),
            chunk_start_offset=start,
            compression="zstd",
            compressed_size=len(packed),
            message_end_time=end,
            message_index_length=len(tail),
            message_index_offsets=places,
            message_start_time=begin,
            uncompressed_size=size,
        )
        self._span = (min(begin, self._span[0]), max(end, self._span[1])) if self._chunks else (begin, end)
        self._chunks.append(_bytes(entry))
        for number in places:
            self._counts[number] += index.shape[1]

    def _append(self, data: bytes) -> int:
        """Write data whole, or leave the file as it was; returns where it begins."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            os.ftruncate(self._file.fileno(), self.size)
            self._file.seek(self.size)
            raise _cannot_write(error, self.path) from error
        self.size += len(data)
        return self.size - len(data)

    def _summary(self) -> bytes:
        """Make the end of the file: what it holds, and where."""
        end = _bytes(DataEnd(0))
        statistics = Statistics(
            attachment_count=len(self._attached),
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=self._span[1],
            message_start_time=self._span[0],
            metadata_count=len(self._texts),
            schema_count=len(self._schemas),
        )
        begin = self.size + len(end)
        known = (*self._schemas.values(), *self._channels, statistics)
        places = (*self._attached, *self._texts)
        summary = b"".join((*map(_bytes, known), *self._chunks, *map(_bytes, places)))
        footer = _bytes(Footer(begin, 0, 0))[:-4]  # without its checksum, which includes the rest of it
        checksum = zlib.crc32(footer, zlib.crc32(summary))
        return end + summary + footer + struct.pack("<I", checksum) + MCAP0_MAGIC


def save(recording: Recording, path: Path) -> None:
    """Write a whole recording to a file; channels of the same times are written together.

    Raises:
        UnknownName: A kind of channel does not exist.
        RecordingError: A channel does not fit its kind, or the file cannot be written.
    """
    writer = RecordingWriter(path, recording.attachments, recording.metadata)
    try:
        for channels in together(recording.channels.values()):
            _save_together(writer, channels)
        for event in recording.events:
            writer.event(event)
        writer.finish(recording.lost)
    finally:
        writer.close()


def _save_together(writer: RecordingWriter, channels: Sequence[Channel]) -> None:
    block = writer.block(channels)
    times = np.rint(1e9 * np.asarray(channels[0].times)).astype(np.int64)
    numbers = np.arange(1, len(times) + 1)
    most = 256  # rows of a chunk
    for begin in range(0, len(times), most):
        part = slice(begin, begin + most)
        values = np.concatenate([channel.values[part] for channel in channels], axis=1)
        writer.write(block, numbers[part], times[part], values)


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _cannot_write(error: OSError, path: Path) -> RecordingError:
    return RecordingError(
        f"the recording cannot be written: {error.strerror}", where=str(path), expected="a file that you may write to"
    )
