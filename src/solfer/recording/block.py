"""Rows of numbers that become messages: many rows at once, since one by one Python would be too slow for a robot."""

import json
import struct
from collections.abc import Sequence

import numpy as np
from mcap.opcode import Opcode

from solfer.errors import RecordingError
from solfer.recording.kinds import JOINT_PARTS, JOINTS_KIND, STAMP_PLACE, Template, check, part_of, template, topic_of
from solfer.recording.model import Channel

_RECORD = "<BQHIQQ"  # of a message: opcode, length, channel, sequence, time of the log, time of publication
_HEADER = struct.calcsize(_RECORD)


class RecordedTopic:
    """Channels that travel in one message.

    Args:
        name: Name of the topic.
        places: Indices of the channels among those of the block.
        channels: The channels, without numbers.
    """

    def __init__(self, name: str, places: Sequence[int], channels: Sequence[Channel]):
        self.name = name
        self.places = tuple(places)
        self.channels = tuple(channels)
        self.kind, self.template = channels[0].kind, template(channels)

    def described(self) -> dict[str, str]:
        """Return the file's description of the topic: the names and units of its channels, as JSON."""
        parts = [[each.name, each.columns, each.units] for each in self.channels]
        return {"channels": json.dumps(parts), "frame": self.channels[0].frame, "child": self.channels[0].child}

    @staticmethod
    def channels_of(kind: str, metadata: dict[str, str]) -> tuple[Channel, ...]:
        """Return the channels of a topic of a file, without numbers; the inverse of `described`.

        Raises:
            RecordingError: They are not channels of a kind.
            UnknownName: The kind does not exist.
        """
        channels = []
        for name, columns, units in json.loads(metadata["channels"]):
            if not all(text.isprintable() for text in (name, *columns, *units)):  # they become names of files
                raise RecordingError("characters that cannot be printed", expected="names of channels and columns")
            channel = Channel(
                name, kind, tuple(columns), units=tuple(units), frame=metadata["frame"], child=metadata["child"]
            )
            check(channel)
            channels.append(channel)
        return tuple(channels)


def topics_of(channels: Sequence[Channel]) -> list[RecordedTopic]:
    """Group channels: those of joints that differ by the field alone share a topic, any other has its own."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for index, channel in enumerate(channels):
        same = (topic_of(channel), channel.columns, channel.frame) if channel.kind == JOINTS_KIND else (channel.name,)
        groups.setdefault(same, []).append(index)
    topics = []
    used = set()
    for places in groups.values():
        ordered = sorted(places, key=lambda place: _rank(channels[place]))
        name = topic_of(channels[ordered[0]])
        # joints of another list on the same topic: a topic has one list
        name = channels[ordered[0]].name if name in used else name
        used.add(name)
        topics.append(RecordedTopic(name, ordered, [channels[place] for place in ordered]))
    return topics


def _rank(channel: Channel) -> int:
    return JOINT_PARTS.index(part_of(channel.name)) if channel.kind == JOINTS_KIND else 0


class Block:
    """Makes messages of the rows of channels that are recorded together.

    Args:
        channels: The channels, without numbers; a row has their columns one after the other.
        first: Number of the first topic in the file.

    Attributes:
        topics: The topics, which have the numbers `first`, `first + 1`, ...
        first: See above.
        width: Columns of a row.
        size: Bytes of a row.
    """

    def __init__(self, channels: Sequence[Channel], first: int):
        self.topics = topics_of(channels)
        self.first = first
        starts = np.cumsum([0, *(len(channel.columns) for channel in channels)])
        self.width = int(starts[-1])
        data = bytearray()
        self._offsets = []
        self._moves: list[tuple[int, int, int]] = []  # where numbers go, where they come from, and how many bytes
        for index, topic in enumerate(self.topics):
            self._offsets.append(len(data))
            content: Template = topic.template
            data += struct.pack(_RECORD, Opcode.MESSAGE, _HEADER - 9 + len(content.data), first + index, 0, 0, 0)
            columns = np.concatenate([np.arange(starts[place], starts[place + 1]) for place in topic.places])
            self._moves += _moves(content.runs, columns, len(data))
            data += content.data
        self._row = np.frombuffer(bytes(data), dtype=np.uint8)
        self.size = len(data)
        # places of the fields of `_RECORD`
        self._times = self._bytes(8, 15, 23)
        self._numbers = self._bytes(4, 11)
        self._stamps = self._bytes(8, _HEADER + STAMP_PLACE)

    def _bytes(self, size: int, *places: int) -> np.ndarray:
        """Return the indices of numbers of so many bytes that are at these places of all messages."""
        begins = np.array([offset + place for offset in self._offsets for place in places], dtype=int)
        return (begins[:, None] + np.arange(size)).ravel()

    def messages(self, numbers: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Make the messages of rows, one row after the other.

        Args:
            numbers: Number of each row, int64, shape (T,).
            times: Its time, int64, shape (T,) [ns].
            values: The columns of all channels, float64, shape (T, width).

        Returns:
            Records of messages, uint8, shape (T, size).
        """
        rows = np.empty((len(times), self.size), dtype=np.uint8)
        rows[:] = self._row
        stamps = np.stack((times // 1_000_000_000, times % 1_000_000_000), axis=1)
        rows[:, self._times] = _repeated(times.astype("<u8"), len(self._times))
        rows[:, self._numbers] = _repeated(numbers.astype("<u4"), len(self._numbers))
        rows[:, self._stamps] = _repeated(stamps.astype("<u4"), len(self._stamps))
        content = np.ascontiguousarray(values, dtype="<f8").view(np.uint8)
        for target, source, size in self._moves:
            rows[:, target : target + size] = content[:, source : source + size]
        return rows

    def offsets(self, rows: int) -> np.ndarray:
        """Return where the messages of so many rows begin, int64, shape (topics, rows)."""
        return np.array(self._offsets)[:, None] + self.size * np.arange(rows)


def _moves(runs: Sequence[tuple[int, int]], columns: np.ndarray, begin: int) -> list[tuple[int, int, int]]:
    """List what is copied into a message at `begin`: the numbers of some columns, a run after the other."""
    moves = []
    used = 0
    for place, count in runs:
        if count:
            moves.append((begin + place, 8 * int(columns[used]), 8 * count))
        used += count
    return moves


def _repeated(numbers: np.ndarray, size: int) -> np.ndarray:
    """Repeat the bytes of each row's number up to a size, uint8, shape (T, size)."""
    content = numbers.view(np.uint8).reshape(len(numbers), -1)
    return np.tile(content, (1, size // max(1, content.shape[1])))
