"""A recording as a ROS 1 bag, for `rosbag play`."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from solfer.errors import MissingDependency, RecordingError
from solfer.recording.block import RecordedTopic, topics_of
from solfer.recording.kinds import JOINT_PARTS, JOINTS_KIND, NAMED, part_of
from solfer.recording.model import Channel, Recording

COLUMNS_MESSAGE = "std_msgs/msg/Float64MultiArray"
"""Message of columns that no message of ROS has: its only dimension is labelled with their names."""

GEOMETRY = ("Point", "Vector3", "Quaternion", "Pose", "Twist")


def groups_of(recording: Recording) -> list[RecordedTopic]:
    """Group channels of the same times to topics; those without rows are left out."""
    same: dict[bytes, list[Channel]] = {}
    for channel in recording.channels.values():
        if len(channel.times):
            same.setdefault(channel.times.tobytes(), []).append(channel)
    return [topic for channels in same.values() for topic in topics_of(channels)]


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
        raise MissingDependency(
            "bags need the package rosbags", expected='pip install "rosbags>=0.10,<0.12"'
        ) from error
    store = get_typestore(Stores.ROS1_NOETIC)
    try:
        path.unlink(missing_ok=True)
        with Writer(path) as bag:
            places = [_places(bag, store, topic) for topic in groups_of(recording)]
            for time, place, row in sorted(_moments(places)):
                topic, connection = places[place]
                message = _message(store, connection.msgtype, topic.channels, row=row, time=time)
                bag.write(connection, time, store.serialize_ros1(message, connection.msgtype))
                yield
    except OSError as error:
        raise RecordingError(
            f"the bag cannot be written: {error.strerror}", where=str(path), expected="a file that you may write to"
        ) from error


def _places(bag: Any, store: Any, topic: RecordedTopic) -> tuple[RecordedTopic, Any]:
    """Announce a topic in the bag; returns it with its connection."""
    kind = topic.channels[0].kind
    message = kind.replace("/", "/msg/") if kind == JOINTS_KIND or kind in NAMED else COLUMNS_MESSAGE
    return topic, bag.add_connection(f"/{topic.name.replace(' ', '_')}", message, typestore=store)


def _moments(places: Sequence[tuple[RecordedTopic, Any]]) -> Iterator[tuple[int, int, int]]:
    """Yield time [ns], place and row of each message."""
    for place, (topic, _) in enumerate(places):
        # `rosbag play` leaves out messages at time 0, which stands for no time
        times = np.maximum(np.rint(1e9 * topic.channels[0].times).astype(np.int64), 1)
        yield from ((time, place, row) for row, time in enumerate(times.tolist()))


def _message(store: Any, kind: str, channels: Sequence[Channel], row: int, time: int) -> Any:
    types = store.types
    first = channels[0]
    if kind == COLUMNS_MESSAGE:
        return _labelled(types, first, row)
    stamp = types["builtin_interfaces/msg/Time"](*divmod(time, 1_000_000_000))
    header = types["std_msgs/msg/Header"](row, stamp, first.frame)
    if first.kind == JOINTS_KIND:
        fields = {part_of(channel.name): channel.values[row] for channel in channels}
        return types[kind](header, list(first.columns), *(fields.get(part, np.zeros(0)) for part in JOINT_PARTS))
    return _of_kind(types, first, header, numbers=first.values[row].tolist())


def _labelled(types: Any, channel: Channel, row: int) -> Any:
    size = len(channel.columns)
    dimension = types["std_msgs/msg/MultiArrayDimension"](",".join(channel.columns), size, size)
    return types[COLUMNS_MESSAGE](types["std_msgs/msg/MultiArrayLayout"]([dimension], 0), channel.values[row])


def _of_kind(types: Any, channel: Channel, header: Any, numbers: list[float]) -> Any:
    """Make a message of geometry, or an odometry."""
    name = channel.kind.partition("/")[2]
    message = types[channel.kind.replace("/", "/msg/")]
    geometry = {
        each: types[f"geometry_msgs/msg/{each}"] for each in ("Point", "Vector3", "Quaternion", "Pose", "Twist")
    }

    def pose() -> Any:
        return geometry["Pose"](geometry["Point"](*numbers[:3]), geometry["Quaternion"](*numbers[3:7]))

    def twist(begin: int) -> Any:
        return geometry["Twist"](*(geometry["Vector3"](*numbers[at : at + 3]) for at in (begin, begin + 3)))

    if name == "Odometry":
        nothing = np.zeros(36)
        with_pose = types["geometry_msgs/msg/PoseWithCovariance"](pose(), nothing)
        return message(
            header, channel.child, with_pose, types["geometry_msgs/msg/TwistWithCovariance"](twist(7), nothing)
        )
    if name == "PoseStamped":
        return message(header, pose())
    if name == "TwistStamped":
        return message(header, twist(0))
    if name == "WrenchStamped":
        parts = (geometry["Vector3"](*numbers[at : at + 3]) for at in (0, 3))
        return message(header, types["geometry_msgs/msg/Wrench"](*parts))
    return message(header, geometry[name.removesuffix("Stamped")](*numbers))
