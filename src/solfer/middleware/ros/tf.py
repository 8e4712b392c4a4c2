"""The pose of the floating base as a transform, for rviz and everything else that uses tf."""

import struct

from tf2_msgs.msg import TFMessage

from solfer.errors import MiddlewareError, UnknownName
from solfer.middleware.ros.codecs.packed_message import MESSAGE_HEADER, MESSAGE_LENGTH, PackedMessage, stamp_of
from solfer.middleware.ros.topic_publisher import TopicPublisher
from solfer.transport import BodyMessage, Middleware

POSE = struct.Struct("<7d")
"""Translation, then quaternion (x, y, z, w)."""


def prefixed(prefix: str, frame: str) -> str:
    """Return the name of a robot's frame on tf."""
    return f"{prefix}/{frame}" if prefix else frame


def tf_prefix(middleware: Middleware) -> str:
    """Read the parameter `tf_prefix` of the nearest namespace, for the frames of one of several robots; empty: none.

    Raises:
        MiddlewareError: It is no text.
    """
    try:
        prefix = middleware.parameter("tf_prefix")
    except UnknownName:
        return ""
    if not isinstance(prefix, str):
        raise MiddlewareError(f"parameter 'tf_prefix' is {prefix!r:.80}", expected="a text, such as the robot's name")
    return prefix.strip("/")


class BaseTransform:
    """Broadcasts poses of a body at whole multiples of a period, at which other measurements have been made, too.

    Args:
        prefix: In front of the body's frame, see `tf_prefix`; the frame of reference is shared.
        rate: Transforms for each second of the sender's clock [Hz].
    """

    def __init__(self, prefix: str = "", rate: float = 200.0):
        self._topic_publisher = TopicPublisher("/tf", TFMessage)
        self._prefix = prefix
        self._rate = rate
        self._sent = -1

    def broadcast(self, message: BodyMessage) -> None:
        """Send the pose of `message.child` in `message.frame` if its stamp is due and was not sent last."""
        periods = message.stamp * self._rate
        due = round(periods)
        if due == self._sent or abs(periods - due) > 1e-6 * self._rate:
            return
        self._sent = due
        if self._topic_publisher.has_subscribers():
            self._topic_publisher.send(PackedMessage(pack(message, stamp_of(message.stamp), self._prefix), name=None))


def base_transform(middleware: Middleware) -> BaseTransform:
    """Make the transform of the simulator's base."""
    return BaseTransform(tf_prefix(middleware))


def pack(message: BodyMessage, stamp: tuple[int, int], prefix: str = "") -> bytes:
    """Pack a tf2_msgs/TFMessage with one transform, and its stamp [s, ns]."""
    frame = message.frame.encode()
    child = prefixed(prefix, message.child).encode()
    return b"".join(
        (
            MESSAGE_LENGTH.pack(1),
            MESSAGE_HEADER.pack(0, *stamp, len(frame)),
            frame,
            MESSAGE_LENGTH.pack(len(child)),
            child,
            POSE.pack(*message.position, *message.orientation),
        )
    )
