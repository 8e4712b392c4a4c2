"""The pose of the floating base as a transform."""

import numpy as np
from tf2_msgs.msg import TFMessage

from solfer.middleware.ros2.cdr import CdrWriter
from solfer.middleware.ros2.middleware import Ros2Middleware
from solfer.middleware.ros2.quality import quality
from solfer.transport import BodyMessage


class Ros2BaseTransform:
    """Broadcasts poses of a body at whole multiples of a period, at which other measurements have been made, too.

    Args:
        middleware: That of the node.
        rate: Transforms for each second of the sender's clock [Hz].
    """

    def __init__(self, middleware: Ros2Middleware, rate: float = 200.0):
        self._publisher = middleware.node.ros.create_publisher(TFMessage, "/tf", quality(100, reliable=True))
        self._stamp_of = middleware.node.clock.stamp_of
        self._rate = rate
        self._sent = -1

    def broadcast(self, message: BodyMessage) -> None:
        """Send the pose of `message.child` in `message.frame` if its stamp is due and was not sent last."""
        periods = message.stamp * self._rate
        due = round(periods)
        if due == self._sent or abs(periods - due) > 1e-6 * self._rate:
            return
        self._sent = due
        if self._publisher.get_subscription_count():
            writer = CdrWriter()
            writer.count(1)
            writer.time(*divmod(self._stamp_of(message.stamp), 1_000_000_000))
            writer.text(message.frame)
            writer.text(message.child)
            writer.numbers(np.concatenate((message.position, message.orientation)))
            self._publisher.publish(bytes(writer.bytes))


def base_transform(middleware: Ros2Middleware) -> Ros2BaseTransform:
    """Make the transform of the simulator's base."""
    return Ros2BaseTransform(middleware)
