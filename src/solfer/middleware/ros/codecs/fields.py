"""ROS messages of topics that components declare, by the names of their fields."""

import dataclasses
import io
import typing
from collections.abc import Mapping
from typing import Any

import genpy
import rospy

from solfer.errors import ComponentError, PipeError
from solfer.middleware.ros.codecs.base import Codec, packed_class, unpack
from solfer.middleware.ros.codecs.interfaces import message_class
from solfer.middleware.ros.codecs.packed_message import MESSAGE_HEADER, PackedMessage
from solfer.transport.messages import FieldsMessage


class FieldsCodec(Codec):
    """A message of any type; its header is stamped, and so are those without a stamp of the messages in its lists.

    Args:
        message: Its name, `package/Type`.

    Raises:
        MissingDependency: The package is not there, or not built.
        UnknownName: The package has no such message.
    """

    messages = ()

    def __init__(self, message: str):
        self._type = message_class(message)
        self.ros_class = packed_class(self._type)

    @classmethod
    def of(cls, message: str) -> "FieldsCodec":
        """See `Codec.of`."""
        return cls(message)

    def encode(self, message: FieldsMessage) -> PackedMessage:
        """See `Codec.encode`; the packed message is a new one each time.

        Raises:
            PipeError: A field has a value that its type cannot hold.
        """
        buffer = io.BytesIO()
        try:
            sent = _filled(self._type, message.fields)
            _stamp(sent)
            sent.serialize(buffer)
        except (genpy.MessageException, TypeError, ValueError, AttributeError) as error:
            raise PipeError(f"no {self._type._type} can be made: {error}", expected="values of its fields") from error
        packed = buffer.getvalue()
        if not self._type._has_header:
            return PackedMessage(packed, None)
        frame = sent.header.frame_id
        stamped = PackedMessage(packed[MESSAGE_HEADER.size + len(frame.encode()) :], frame)
        stamped.stamp()
        return stamped

    def decode(self, packed: bytes, sender: str) -> FieldsMessage:
        """See `Codec.decode`."""
        published = unpack(self._type, packed)
        stamp = published.header.stamp.to_sec() if self._type._has_header else 0.0
        return FieldsMessage(_fields(published), stamp, sender)


def require_fields(interface: str, message: type) -> None:
    """Check that the fields of a dataclass are fields of an interface, nested ones as well.

    Raises:
        ComponentError: One is not.
        MissingDependency: The package of the interface is not there, or not built.
        UnknownName: The package has no such message.
    """
    ros_class = message_class(interface)
    types = dict(zip(ros_class.__slots__, ros_class._slot_types, strict=True))
    hints = typing.get_type_hints(message)
    for field in dataclasses.fields(message):
        if field.name not in types:
            raise ComponentError(
                f"{message.__name__} has a field '{field.name}', {interface} does not",
                expected=f"some of {', '.join(types)}",
            )
        hint = hints[field.name]
        nested = typing.get_args(hint)[0] if typing.get_origin(hint) is tuple else hint
        if isinstance(nested, type) and dataclasses.is_dataclass(nested):
            require_fields(types[field.name].partition("[")[0], nested)


def _stamp(message: genpy.Message) -> None:
    """Stamp messages in lists, as tf has them."""
    for slot, kind in zip(message.__slots__, message._slot_types, strict=True):
        if kind.endswith("]") and "/" in kind:
            for each in getattr(message, slot):
                if each._has_header and not each.header.stamp:
                    each.header.stamp = rospy.Time.now()


def _filled(ros_class: Any, fields: Mapping[str, Any]) -> genpy.Message:
    made = ros_class()
    for slot, kind in zip(ros_class.__slots__, ros_class._slot_types, strict=True):
        if slot in fields:
            setattr(made, slot, _to_ros(kind, fields[slot]))
    return made


def _to_ros(kind: str, value: Any) -> Any:
    """Convert the value of a field to what a type of ROS holds."""
    element, bracket, _ = kind.partition("[")
    if bracket:
        return bytes(value) if element in ("uint8", "char") else [_to_ros(element, each) for each in value]
    if kind == "time":
        return genpy.Time.from_sec(value)
    if kind == "duration":
        return genpy.Duration.from_sec(value)
    return value if "/" not in kind else _filled(message_class(kind), value)


def _fields(message: genpy.Message) -> dict[str, Any]:
    return {slot: _from_ros(getattr(message, slot)) for slot in message.__slots__}


def _from_ros(value: Any) -> Any:
    """Convert a value of a ROS message: messages to mappings, lists to tuples, times to seconds."""
    if isinstance(value, genpy.Message):
        return _fields(value)
    if isinstance(value, genpy.rostime.TVal):
        return value.to_sec()
    return tuple(_from_ros(each) for each in value) if isinstance(value, list | tuple | bytes) else value
