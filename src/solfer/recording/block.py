"""Rows of numbers that become messages: many rows at once, since one by one Python would be too slow for a robot."""

import json
import struct
from collections.abc import Iterable, Sequence

import numpy as np
from mcap.opcode import Opcode

from solfer.errors import RecordingError
from solfer.recording.kinds import JOINT_PARTS, JOINTS_KIND, STAMP_PLACE, check, part_of, template, topic_of
from solfer.recording.model import Channel

_HEAD = struct.Struct("<BQH")
"""Begin of the record of a message: opcode, length, channel. Its number and both times follow."""

_NUMBERED = 20
"""Bytes of a number and of both times."""

CONTENT = _HEAD.size + _NUMBERED
"""Where the content begins in the record of a message."""


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


def together(channels: Iterable[Channel]) -> list[list[Channel]]:
    """Group channels of the same times."""
    groups: dict[bytes, list[Channel]] = {}
    for channel in channels:
        groups.setdefault(np.asarray(channel.times, dtype=float).tobytes(), []).append(channel)
    return list(groups.values())


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
        # what differs from row to row, of which each message has its parts
        fields = [("number", "<u4"), ("times", "<u8", (2,)), ("stamp", "<u4", (2,)), ("values", "<f8", (self.width,))]
        self._varying = np.dtype(fields)
        data = bytearray()
        self._offsets = []
        self._moves: list[tuple[int, int, int]] = []  # where bytes go, where they come from, and how many
        for index, topic in enumerate(self.topics):
            begin = len(data)
            self._offsets.append(begin)
            data += _HEAD.pack(Opcode.MESSAGE, CONTENT - 9 + len(topic.template.data), first + index)
            data += bytes(_NUMBERED) + topic.template.data
            self._moves += [(begin + _HEAD.size, 0, _NUMBERED), (begin + CONTENT + STAMP_PLACE, _NUMBERED, 8)]
            columns = np.concatenate([np.arange(starts[place], starts[place + 1]) for place in topic.places])
            for place, count in topic.template.runs:
                if count:
                    self._moves.append((begin + CONTENT + place, _NUMBERED + 8 * (1 + int(columns[0])), 8 * count))
                columns = columns[count:]
        self._row = np.frombuffer(bytes(data), dtype=np.uint8)
        self.size = len(data)

    def messages(self, numbers: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Make the messages of rows, one row after the other.

        Args:
            numbers: Number of each row, int64, shape (T,).
            times: Its time, int64, shape (T,) [ns].
            values: The columns of all channels, float64, shape (T, width).

        Returns:
            Records of messages, uint8, shape (T, size).
        """
        varying = np.empty(len(times), dtype=self._varying)
        varying["number"] = numbers
        varying["times"] = times[:, None]
        varying["stamp"] = np.stack(np.divmod(times, 1_000_000_000), axis=1)
        varying["values"] = values
        content = varying.view(np.uint8).reshape(len(times), self._varying.itemsize)
        rows = np.tile(self._row, (len(times), 1))
        for target, source, size in self._moves:
            rows[:, target : target + size] = content[:, source : source + size]
        return rows

    def offsets(self, rows: int) -> np.ndarray:
        """Return where the messages of so many rows begin, int64, shape (topics, rows)."""
        return np.array(self._offsets)[:, None] + self.size * np.arange(rows)
