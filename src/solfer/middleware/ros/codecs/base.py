"""What every codec is, and classes of messages that stay packed.

Messages stay packed until they are read: rospy's receiving thread only keeps the bytes, and the loop decodes the newest
of them.
"""

import abc
import functools
from collections.abc import Collection
from typing import Any, ClassVar

import genpy

from solfer.errors import PipeError
from solfer.middleware.ros.codecs.packed_message import PackedMessage
from solfer.transport.messages import Message


class Codec(abc.ABC):
    """Translates one type of message, or several that are alike.

    Attributes:
        messages: Their canonical names.
        ros_class: Class to publish and to subscribe with: the type of the message, but what comes in stays in `packed`.
    """

    messages: ClassVar[Collection[str]]
    ros_class: Any

    @classmethod
    def of(cls, message: str) -> "Codec":
        """Make the codec of one of `messages`."""
        return cls()

    @abc.abstractmethod
    def encode(self, message: Message) -> PackedMessage:
        """Pack a message for the wire, stamped with the ROS time at which it was measured, or else sent.

        The packed message is the same object each time as long as the names in the message are the same.
        """

    @abc.abstractmethod
    def decode(self, packed: bytes, sender: str) -> Message:
        """Unpack the numbers in the bytes of a message.

        Raises:
            PipeError: The bytes contradict the type, or themselves.
        """


@functools.cache
def packed_class(ros_class: Any) -> Any:
    """Make a class that looks like `ros_class` to rospy and keeps its messages packed."""

    class Packed(ros_class):
        def deserialize(self, data):
            self.packed = data
            return self

    Packed.__name__ = ros_class.__name__
    return Packed


def unpack(ros_class: Any, packed: bytes) -> genpy.Message:
    """Unpack the bytes of a message of a type.

    Raises:
        PipeError: The bytes are not such a message.
    """
    try:
        return ros_class().deserialize(packed)
    except (genpy.DeserializationError, UnicodeError) as error:
        raise PipeError(
            f"{len(packed)} bytes are not a whole {ros_class._type}", expected="a message as its publisher packed it"
        ) from error
