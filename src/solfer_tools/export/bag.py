"""A recording as a ROS 1 bag, for `rosbag play`."""

import heapq
import itertools
import struct
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from solfer.errors import MissingDependency, RecordingError, writing
from solfer.installation import pip_install
from solfer.recording.block import CONTENT, Block, RecordedTopic, together, topics_of
from solfer.recording.model import COLUMNS_KIND, Recording

COLUMNS_MESSAGE = "std_msgs/msg/Float64MultiArray"
"""Message of columns that no message of ROS has: its only dimension is labelled with their names."""


def groups_of(recording: Recording) -> list[RecordedTopic]:
    """Group channels of the same times to topics; those without rows are left out."""
    groups = together(recording.filled)
    return [topic for channels in groups for topic in topics_of(channels)]


def messages_in(recording: Recording) -> int:
    """Return how many messages a bag will have."""
    return sum(len(topic.channels[0].times) for topic in groups_of(recording))


def save_bag(recording: Recording, path: Path) -> Iterator[None]:
    """Write a bag; yields after each message.

    Raises:
        MissingDependency: The package rosbags is not installed.
        RecordingError: The bag cannot be written.
    """
    try:
        from rosbags.rosbag1 import Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        expected = pip_install("rosbags>=0.10,<0.12")
        raise MissingDependency("bags need the package rosbags", expected=expected) from error
    store = get_typestore(Stores.ROS1_NOETIC)
    ros2 = get_typestore(Stores.ROS2_HUMBLE)
    with writing("the bag", path, RecordingError):
        path.unlink(missing_ok=True)
        with Writer(path) as bag:
            streams = []
            for topic in groups_of(recording):
                kind = topic.kind.replace("/", "/msg/") if topic.kind != COLUMNS_KIND else COLUMNS_MESSAGE
                place = bag.add_connection(f"/{topic.name.replace(' ', '_')}", kind, typestore=store)
                messages = _labelled(topic, store) if kind == COLUMNS_MESSAGE else _converted(topic, kind, ros2)
                times = _times(topic).tolist()
                streams.append(zip(times, itertools.repeat(place, len(times)), messages, strict=True))
            for time, place, message in heapq.merge(*streams, key=itemgetter(0)):
                bag.write(place, time, message)
                yield


def _times(topic: RecordedTopic) -> np.ndarray:
    """Return the times of the messages [ns]."""
    # `rosbag play` leaves out messages at time 0, which stands for no time
    return np.maximum(np.rint(1e9 * topic.channels[0].times).astype(np.int64), 1)


def _labelled(topic: RecordedTopic, store: Any) -> Iterator[bytes]:
    types = store.types
    columns = topic.channels[0].columns
    dimension = types["std_msgs/msg/MultiArrayDimension"](",".join(columns), len(columns), len(columns))
    layout = types["std_msgs/msg/MultiArrayLayout"]([dimension], 0)
    for row in topic.channels[0].values:
        yield store.serialize_ros1(types[COLUMNS_MESSAGE](layout, row), COLUMNS_MESSAGE)


def _converted(topic: RecordedTopic, kind: str, ros2: Any) -> Iterator[bytes]:
    """Yield the messages of a topic as ROS 2 has them, converted to ROS 1, whose headers also have a number."""
    block = Block(topic.channels, 0)
    times = _times(topic)
    values = np.concatenate([channel.values for channel in topic.channels], axis=1)
    most = 256  # rows at a time
    for begin in range(0, len(times), most):
        part = slice(begin, begin + most)
        for row, message in enumerate(block.messages(times[part], times[part], values[part]), begin):
            yield struct.pack("<I", row) + ros2.cdr_to_ros1(message[CONTENT:].tobytes(), kind)[4:]
