"""What every codec is, and classes of messages that stay packed.

Messages stay packed until somebody reads them: rospy's receiving thread only keeps the bytes, and the loop decodes
the newest of them.
"""

import abc
import functools

import genpy

from solfer.errors import PipeError
from solfer.middleware.ros.frame import Frame
from solfer.pipes.messages import Message


class Codec(abc.ABC):
    """Translates one type of message.

    Attributes:
        ros_class: Class to publish and to subscribe with: the type of the message, but what comes in stays in `packed`.
    """

    ros_class: type

    @abc.abstractmethod
    def encode(self, message: Message) -> Frame:
        """The message as it goes over the wire, stamped with the present ROS time.

        It is the same object each time as long as the names in the message are the same.
        """

    @abc.abstractmethod
    def decode(self, packed: bytes, sender: str) -> Message:
        """The numbers in the bytes of a message.

        Raises:
            PipeError: The bytes contradict the type, or themselves.
        """


@functools.cache
def packed_class(ros_class: type) -> type:
    """A class that looks like `ros_class` to rospy; what comes in stays packed."""

    class Packed(ros_class):
        def deserialize(self, data):
            self.packed = data
            return self

    Packed.__name__ = ros_class.__name__
    return Packed


def unpack(ros_class: type, packed: bytes) -> genpy.Message:
    """The message of a type that is in the bytes.

    Raises:
        PipeError: The bytes are no such message.
    """
    try:
        return ros_class().deserialize(packed)
    except (genpy.DeserializationError, UnicodeError) as error:
        raise PipeError(f"{len(packed)} bytes are no whole {ros_class._type}") from error
