"""Kinds of channels: the ROS 2 messages that carry them, and their layout in CDR.

All messages of a channel are alike but for stamp and numbers: `Template` has the bytes of one, and where they are.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

from solfer.errors import RecordingError, UnknownName
from solfer.recording.model import COLUMNS_KIND, JOINTS_KIND, Channel

JOINT_PARTS = ("position", "velocity", "effort")
"""Fields of a message of joints, each a channel of its own."""

_XYZ = ("x", "y", "z")
_QUATERNION = ("qx", "qy", "qz", "qw")
_TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")

NAMED = {
    "nav_msgs/Odometry": (*_XYZ, *_QUATERNION, *_TWIST),
    "geometry_msgs/WrenchStamped": ("fx", "fy", "fz", "tx", "ty", "tz"),
    "geometry_msgs/PointStamped": _XYZ,
    "geometry_msgs/Vector3Stamped": _XYZ,
    "geometry_msgs/QuaternionStamped": _QUATERNION,
    "geometry_msgs/PoseStamped": (*_XYZ, *_QUATERNION),
    "geometry_msgs/TwistStamped": _TWIST,
}
"""Columns of the kinds that say themselves what each of their numbers is."""

UNITS = {
    **dict.fromkeys(_XYZ, "m"),
    **dict.fromkeys(_TWIST[:3], "m/s"),
    **dict.fromkeys(_TWIST[3:], "rad/s"),
    **dict.fromkeys(("fx", "fy", "fz"), "N"),
    **dict.fromkeys(("tx", "ty", "tz"), "Nm"),
}
"""Units of these columns; a quaternion has none."""

KINDS = (COLUMNS_KIND, JOINTS_KIND, *NAMED)
"""All kinds of channels."""

EVENT_MESSAGE = "diagnostic_msgs/DiagnosticArray"
"""Message of an event."""

_DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "geometry_msgs/PointStamped": "std_msgs/Header header\ngeometry_msgs/Point point",
    "geometry_msgs/Vector3Stamped": "std_msgs/Header header\ngeometry_msgs/Vector3 vector",
    "geometry_msgs/QuaternionStamped": "std_msgs/Header header\ngeometry_msgs/Quaternion quaternion",
    "geometry_msgs/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
    "geometry_msgs/TwistStamped": "std_msgs/Header header\ngeometry_msgs/Twist twist",
    "geometry_msgs/WrenchStamped": "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
    "nav_msgs/Odometry": "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist",
    JOINTS_KIND: "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
    COLUMNS_KIND: "std_msgs/Header header\nfloat64[] values",
    "diagnostic_msgs/KeyValue": "string key\nstring value",
    "diagnostic_msgs/DiagnosticStatus": "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\n"
    "string message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values",
    EVENT_MESSAGE: "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status",
}


def ros_name(kind: str) -> str:
    """Return the name of a message in ROS 2: `package/msg/Type`."""
    return kind.replace("/", "/msg/")


def definition(kind: str) -> str:
    """Return the definition of a message with those of all messages in it, as a schema `ros2msg` has to be."""
    found = [kind]
    for each in found:
        types = (line.split()[0].partition("[")[0] for line in _DEFINITIONS[each].splitlines())
        found += [name for name in types if "/" in name and name not in found]
    parts = (f"MSG: {each}\n{_DEFINITIONS[each]}" for each in found[1:])
    return "\n".join([_DEFINITIONS[kind], *(f"{'=' * 80}\n{part}" for part in parts), ""])


class Cdr:
    """Writes a message in little-endian CDR."""

    def __init__(self) -> None:
        self.data = bytearray(b"\x00\x01\x00\x00")

    def number(self, form: str, value: float) -> int:
        """Append a number of a form of `struct`, aligned to its size; returns where it is."""
        size = struct.calcsize(f"<{form}")
        self.data += bytes(-(len(self.data) - 4) % size)  # the alignment counts from behind the first four bytes
        self.data += struct.pack(f"<{form}", value)
        return len(self.data) - size

    def string(self, text: str) -> None:
        """Append a text."""
        content = text.encode() + b"\0"
        self.number("I", len(content))
        self.data += content

    def doubles(self, count: int) -> int:
        """Append so many zeros; returns where they are."""
        places = [self.number("d", 0.0) for _ in range(count)]
        return places[0] if places else len(self.data)

    def header(self, frame: str) -> None:
        """Append a header; its stamp is at `STAMP_PLACE`."""
        self.number("i", 0)
        self.number("I", 0)
        self.string(frame)


STAMP_PLACE = 4
"""Where the stamp of a message is: seconds and nanoseconds, four bytes each."""


@dataclass(frozen=True)
class Template:
    """The bytes of a message.

    Attributes:
        data: The message with a stamp and numbers of zero.
        runs: Where its numbers are, in the order of the columns of all its channels: the first byte, and how many
            follow each other.
    """

    data: bytes
    runs: tuple[tuple[int, int], ...]


def template(channels: Sequence[Channel]) -> Template:
    """Lay out the message of channels that travel in one: those of a topic, in the order of `parts_of`."""
    first = channels[0]
    cdr = Cdr()
    cdr.header(first.frame)
    if first.kind == JOINTS_KIND:
        runs = _joints(cdr, channels)
    elif first.kind == COLUMNS_KIND:
        runs = [_sequence(cdr, len(first.columns))]
    elif first.kind == "nav_msgs/Odometry":
        runs = _odometry(cdr, first.child)
    else:
        runs = [(cdr.doubles(len(first.columns)), len(first.columns))]
    return Template(bytes(cdr.data), tuple(runs))


def _sequence(cdr: Cdr, count: int) -> tuple[int, int]:
    cdr.number("I", count)
    return cdr.doubles(count), count


def _joints(cdr: Cdr, channels: Sequence[Channel]) -> list[tuple[int, int]]:
    names = channels[0].columns
    cdr.number("I", len(names))
    for name in names:
        cdr.string(name)
    carried = {part_of(channel.name): channel for channel in channels}
    places = {part: _sequence(cdr, len(names) if part in carried else 0) for part in JOINT_PARTS}
    return [places[part] for part in carried]


def _odometry(cdr: Cdr, child: str) -> list[tuple[int, int]]:
    cdr.string(child)
    pose = cdr.doubles(7)
    cdr.doubles(36)
    twist = cdr.doubles(6)
    cdr.doubles(36)
    return [(pose, 7), (twist, 6)]


def part_of(name: str) -> str:
    """Return the last part of a channel's name."""
    return name.rpartition("/")[2]


def topic_of(channel: Channel) -> str:
    """Return the topic of a channel: its name, without the field if it is one of a message of joints."""
    return channel.name.rpartition("/")[0] if channel.kind == JOINTS_KIND else channel.name


def check(channel: Channel) -> None:
    """Check that a file can hold a channel.

    Raises:
        UnknownName: Its kind does not exist.
        RecordingError: Its name or its columns are not those of its kind.
    """
    where = f"channel '{channel.name}'"
    if channel.kind not in KINDS:
        raise UnknownName("kind of channel", channel.kind, KINDS, where=where)
    if channel.kind == JOINTS_KIND and (part_of(channel.name) not in JOINT_PARTS or not topic_of(channel)):
        raise RecordingError(
            "a channel of joints without its field", where=where, expected=f"<name>/{{{','.join(JOINT_PARTS)}}}"
        )
    if channel.kind in NAMED and channel.columns != NAMED[channel.kind]:
        raise RecordingError(
            f"columns {' '.join(channel.columns)} of {channel.kind}",
            where=where,
            expected=" ".join(NAMED[channel.kind]),
        )
