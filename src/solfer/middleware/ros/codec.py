"""What every codec is, and classes of messages that stay packed.

Messages stay packed until somebody reads them: rospy's receiving thread only keeps the bytes, and the loop decodes
the newest of them.
"""

import abc
import functools

import genpy

from solfer.pipes.messages import Message


class Codec(abc.ABC):
    """Translates one type of message.

    Attributes:
        ros_class: Class to publish and to subscribe with: the type of the message, but it keeps its bytes in `packed`.
    """

    ros_class: type

    @abc.abstractmethod
    def encode(self, message: Message) -> genpy.Message:
        """A message for rospy, stamped with the present ROS time; it is the same object each time."""

    @abc.abstractmethod
    def decode(self, packed: bytes, sender: str) -> Message:
        """The numbers in the bytes of a message.

        Raises:
            PipeError: The bytes contradict the type, or themselves.
        """


@functools.cache
def packed_class(ros_class: type) -> type:
    """A class that looks like `ros_class` to rospy; what is behind the header stays packed."""

    class Packed(ros_class):
        def serialize(self, buff):
            self.header.serialize(buff)
            buff.write(self.packed)

        def deserialize(self, data):
            self.packed = data
            return self

    Packed.__name__ = ros_class.__name__
    return Packed
