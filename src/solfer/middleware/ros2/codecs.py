"""Packed messages of ROS 2 to named numbers and back."""

import dataclasses
import functools
import importlib
import struct
import time
import typing
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

from solfer.errors import ComponentError, MissingDependency, PipeError, UnknownName
from solfer.middleware.ros2.cdr import CdrReader, CdrWriter
from solfer.transport.inexact import InexactOrientations
from solfer.transport.messages import (
    ANY_INTERFACE,
    BODY_MESSAGES,
    IMU_MESSAGES,
    JOINT_MESSAGES,
    REFUSALS,
    ROBOT_POINTS,
    VECTOR_MESSAGES,
    WRENCH_MESSAGES,
    FieldsMessage,
    JointMessage,
    Message,
    PointsMessage,
    RefusalMessage,
    VectorMessage,
    WrenchMessage,
)
from solfer.transport.wire_numbers import BODY_NUMBERS, IMU_NUMBERS, body_of, imu_of, put_body, put_imu

NANOSECONDS = 1_000_000_000

StampOf = Callable[[float], int]
"""Returns the stamp [ns] of what was measured at a time of this process [s]; of zero, which is unknown, the present."""


def wall_stamp(_: float) -> int:
    """Return the present of the wall clock [ns]."""
    return time.time_ns()


def interface(name: str, kind: str = "msg") -> Any:
    """Import the class of the message (`msg`) or service type (`srv`) `package/Type`.

    Raises:
        MissingDependency: The package is not there, or not built.
        UnknownName: The package has no such type.
    """
    package, _, type_name = name.partition("/")
    try:
        module = importlib.import_module(f"{package}.{kind}")
    except ImportError as error:
        raise MissingDependency(
            f"no Python module {package}.{kind} for {name}",
            expected=f"ROS 2 package '{package}', built and on the path",
        ) from error
    found = getattr(module, type_name, None)
    if found is None:
        raise UnknownName(f"type in {package}", type_name, [each for each in vars(module) if each[:1].isupper()])
    return found


class CdrCodec:
    """Translates one type of message. This one is of any type, by the names of its fields.

    Args:
        message: Canonical name of the message.
        stamp_of: Stamps what is encoded.

    Attributes:
        ros_class: Its class.

    Raises:
        MissingDependency: The package of the message is not there, or not built.
        UnknownName: The package has no such message.
    """

    def __init__(self, message: str, stamp_of: StampOf = wall_stamp):
        self.ros_class = interface(message)
        self._message = message
        self._stamp_of = stamp_of
        self._has_header = "header" in self.ros_class.get_fields_and_field_types()

    def encode(self, message: Any) -> bytes:
        """Pack a message.

        Raises:
            PipeError: A field has a value that its type cannot hold.
        """
        try:
            sent = filled(self.ros_class, message.fields)
            self._stamp(sent)
            return serialize_message(sent)
        except (AssertionError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise PipeError(f"no {self._message} can be made: {error}", expected="values of its fields") from error

    def decode(self, packed: bytes, sender: str) -> Message:
        """Unpack a message.

        Raises:
            PipeError: The bytes contradict the type, or themselves.
        """
        try:
            return self._read(packed, sender)
        except (struct.error, ValueError, RuntimeError) as error:  # rclpy has an error of its own for bytes
            raise PipeError(
                f"{len(packed)} bytes are not a whole {self._message}: {error}",
                expected="a message as its publisher packed it",
            ) from error

    def _read(self, packed: bytes, sender: str) -> Message:
        fields = plain(deserialize_message(packed, self.ros_class))
        return FieldsMessage(fields, fields["header"]["stamp"] if self._has_header else 0.0, sender)

    def _stamp(self, message: Any) -> None:
        """Stamp a message, and those without a stamp in its lists, as tf has them."""
        if self._has_header:
            message.header.stamp = to_time(self._stamp_of(0.0))
        for name, kind in message.get_fields_and_field_types().items():
            if kind.startswith("sequence<") and "/" in kind:
                for each in getattr(message, name):
                    if hasattr(each, "header") and not (each.header.stamp.sec or each.header.stamp.nanosec):
                        each.header.stamp = to_time(self._stamp_of(0.0))

    def _header(self, message: Any, frame: str = "") -> CdrWriter:
        writer = CdrWriter()
        writer.time(*divmod(self._stamp_of(message.stamp), NANOSECONDS))
        writer.text(frame)
        return writer


class CdrJointCodec(CdrCodec):
    """sensor_msgs/JointState and solfer/JointCommand: names, and arrays that are empty or as long as the names."""

    def __init__(self, message: str, stamp_of: StampOf = wall_stamp):
        super().__init__(message, stamp_of)
        self._fields = JOINT_MESSAGES[message]
        self._open = message == ANY_INTERFACE
        self._names: tuple[str, ...] = ()
        self._interfaces: tuple[str, ...] = ()

    def encode(self, message: JointMessage) -> bytes:
        """See `CdrCodec.encode`."""
        writer = self._header(message)
        writer.texts(message.names)
        for name in self._fields:
            writer.array(getattr(message, name))
        if self._open:
            writer.texts(message.interfaces)
            writer.array(None if message.values is None else message.values.ravel())
            writer.text(message.component)
        return bytes(writer.bytes)

    def _read(self, packed: bytes, sender: str) -> JointMessage:
        reader = CdrReader(packed)
        stamp, _ = reader.time(), reader.text()
        self._names = names = reader.texts(self._names)
        message = JointMessage(names, stamp=stamp, sender=sender)
        for name in self._fields:
            values = reader.array()
            if len(values) not in (0, len(names)):
                raise PipeError(
                    f"{len(values)} numbers in '{name}' for {len(names)} names", expected="none, or one a name"
                )
            if len(values):
                setattr(message, name, values)
        if self._open:
            self._interfaces = interfaces = reader.texts(self._interfaces)
            values = reader.array()
            if len(values) != len(interfaces) * len(names):
                raise PipeError(
                    f"{len(values)} numbers in 'value' for {len(interfaces)} interfaces of {len(names)} names",
                    expected="one for each interface and name",
                )
            if interfaces:
                message.interfaces, message.values = interfaces, values.reshape(len(interfaces), -1)
            message.component = reader.text()
        return message


class CdrBodyCodec(CdrCodec):
    """nav_msgs/Odometry."""

    def __init__(self, message: str, stamp_of: StampOf = wall_stamp):
        super().__init__(message, stamp_of)
        self._inexact = InexactOrientations()
        self._numbers = np.zeros(BODY_NUMBERS)

    def encode(self, message: Any) -> bytes:
        """See `CdrCodec.encode`."""
        writer = self._header(message, message.frame)
        writer.text(message.child)
        put_body(message, self._numbers)
        writer.numbers(self._numbers)
        return bytes(writer.bytes)

    def _read(self, packed: bytes, sender: str) -> Message:
        reader = CdrReader(packed)
        stamp, frame, child = reader.time(), reader.text(), reader.text()
        return body_of(reader.numbers(BODY_NUMBERS), self._inexact, frame, child, stamp=stamp, sender=sender)


class CdrImuCodec(CdrCodec):
    """sensor_msgs/Imu."""

    def __init__(self, message: str, stamp_of: StampOf = wall_stamp):
        super().__init__(message, stamp_of)
        self._inexact = InexactOrientations()

    def encode(self, message: Any) -> bytes:
        """See `CdrCodec.encode`."""
        writer = self._header(message, message.frame)
        numbers = np.zeros(IMU_NUMBERS)
        put_imu(message, numbers)
        writer.numbers(numbers)
        return bytes(writer.bytes)

    def _read(self, packed: bytes, sender: str) -> Message:
        reader = CdrReader(packed)
        stamp, frame = reader.time(), reader.text()
        return imu_of(reader.numbers(IMU_NUMBERS), self._inexact, frame, stamp=stamp, sender=sender)


class CdrWrenchCodec(CdrCodec):
    """geometry_msgs/WrenchStamped."""

    def encode(self, message: Any) -> bytes:
        """See `CdrCodec.encode`."""
        writer = self._header(message, message.frame)
        writer.numbers(message.force)
        writer.numbers(message.torque)
        return bytes(writer.bytes)

    def _read(self, packed: bytes, sender: str) -> Message:
        reader = CdrReader(packed)
        stamp, frame = reader.time(), reader.text()
        return WrenchMessage(frame, reader.numbers(3), reader.numbers(3), stamp=stamp, sender=sender)


class CdrVectorCodec(CdrCodec):
    """A header and a fixed count of numbers."""

    def __init__(self, message: str, stamp_of: StampOf = wall_stamp):
        super().__init__(message, stamp_of)
        self._count = VECTOR_MESSAGES[message]

    def encode(self, message: Any) -> bytes:
        """See `CdrCodec.encode`."""
        writer = self._header(message, message.frame)
        writer.numbers(message.values)
        return bytes(writer.bytes)

    def _read(self, packed: bytes, sender: str) -> Message:
        reader = CdrReader(packed)
        stamp, frame = reader.time(), reader.text()
        return VectorMessage(frame, reader.numbers(self._count), stamp, sender)


class CdrPointsCodec(CdrCodec):
    """solfer/RobotPoints."""

    def encode(self, message: Any) -> bytes:
        """See `CdrCodec.encode`."""
        writer = self._header(message, message.frame)
        writer.texts(tuple(message.names))
        writer.count(len(message.values))
        writer.array(message.values.ravel())
        return bytes(writer.bytes)

    def _read(self, packed: bytes, sender: str) -> Message:
        reader = CdrReader(packed)
        stamp, frame = reader.time(), reader.text()
        names, count, values = reader.texts(()), reader.count(), reader.array()
        if count == 0 or len(values) % count or len(names) not in (0, count):
            raise PipeError(
                f"{len(values)} numbers and {len(names)} names for {count} Points",
                expected="as many numbers for each, and a name for each or none",
            )
        return PointsMessage(frame, names, values.reshape(count, -1), stamp, sender)


class CdrRefusalCodec(CdrCodec):
    """solfer/Refusals."""

    def encode(self, message: Any) -> bytes:
        """See `CdrCodec.encode`."""
        writer = self._header(message)
        writer.texts(message.owners)
        writer.flags(message.claims)
        writer.texts(message.reasons)
        return bytes(writer.bytes)

    def _read(self, packed: bytes, sender: str) -> Message:
        reader = CdrReader(packed)
        stamp, _ = reader.time(), reader.text()
        return RefusalMessage(reader.texts(()), reader.flags(), reader.texts(()), stamp, sender)


_KINDS: dict[str, type[CdrCodec]] = {
    **dict.fromkeys(JOINT_MESSAGES, CdrJointCodec),
    **dict.fromkeys(BODY_MESSAGES, CdrBodyCodec),
    **dict.fromkeys(VECTOR_MESSAGES, CdrVectorCodec),
    ROBOT_POINTS: CdrPointsCodec,
    **dict.fromkeys(IMU_MESSAGES, CdrImuCodec),
    **dict.fromkeys(WRENCH_MESSAGES, CdrWrenchCodec),
    REFUSALS: CdrRefusalCodec,
}


def codec(message: str, stamp_of: StampOf = wall_stamp) -> CdrCodec:
    """Make the codec of a message by its canonical name; one that no pipe carries travels by its fields.

    Raises:
        MissingDependency: The package of the message is not there, or not built.
        UnknownName: The package has no such message.
    """
    return _KINDS.get(message, CdrCodec)(message, stamp_of)


def to_time(nanoseconds: int) -> Any:
    """Convert a time [ns] to a builtin_interfaces/Time."""
    seconds, rest = divmod(nanoseconds, NANOSECONDS)
    return interface("builtin_interfaces/Time")(sec=seconds, nanosec=rest)


def plain(value: Any) -> Any:
    """Convert a value of a ROS message: messages to mappings, lists to tuples, times to seconds."""
    if hasattr(value, "get_fields_and_field_types"):
        names = value.get_fields_and_field_types()
        if tuple(names) == ("sec", "nanosec"):
            return value.sec + 1e-9 * value.nanosec
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, np.ndarray):
        return tuple(value.tolist())
    if isinstance(value, str) or not hasattr(value, "__iter__"):
        return value
    return tuple(map(plain, value))


def filled(ros_class: Any, fields: Mapping[str, Any]) -> Any:
    """Make a ROS message of mappings, tuples and times [s]; fields that are missing keep their defaults."""
    made = ros_class()
    for name, kind in made.get_fields_and_field_types().items():
        if name in fields:
            setattr(made, name, _to_ros(kind, fields[name]))
    return made


def _to_ros(kind: str, value: Any) -> Any:
    """Convert the value of a field to what a type of ROS holds, such as `sequence<double>` or `geometry_msgs/Pose`."""
    element = _element(kind)
    if element != kind:
        return bytes(value) if element in ("octet", "char") else [_to_ros(element, each) for each in value]
    if kind in ("builtin_interfaces/Time", "builtin_interfaces/Duration"):
        seconds, rest = divmod(round(1e9 * value), NANOSECONDS)
        return interface(kind)(sec=seconds, nanosec=rest)
    if "/" in kind:
        return filled(interface(kind), value)
    return float(value) if kind in ("double", "float") else value


def _element(kind: str) -> str:
    """Return the type of the elements of a list's type, such as `sequence<double, 3>` or `double[3]`; else the type."""
    if kind.startswith("sequence<"):
        return kind.removeprefix("sequence<").rstrip(">").partition(",")[0]
    return kind.partition("[")[0]


@functools.cache
def field_types(name: str) -> dict[str, str]:
    """Return the types of the fields of a message."""
    return dict(interface(name).get_fields_and_field_types())


def require_fields(name: str, message: type) -> None:
    """Check that the fields of a dataclass are fields of an interface, nested ones as well.

    Raises:
        ComponentError: One is not.
        MissingDependency: The package of the interface is not there, or not built.
        UnknownName: The package has no such message.
    """
    types = field_types(name)
    hints = typing.get_type_hints(message)
    for field in dataclasses.fields(message):
        if field.name not in types:
            raise ComponentError(
                f"{message.__name__} has a field '{field.name}', {name} does not",
                expected=f"some of {', '.join(types)}",
            )
        hint = hints[field.name]
        nested = typing.get_args(hint)[0] if typing.get_origin(hint) is tuple else hint
        if isinstance(nested, type) and dataclasses.is_dataclass(nested):
            require_fields(_element(types[field.name]), nested)
