"""The pose of the floating base as a transform, for rviz and everything else that uses tf."""

import struct
import time

import rospy
from tf2_msgs.msg import TFMessage

from solfer.middleware.ros.frame import HEADER, LENGTH, Frame
from solfer.middleware.ros.outlet import Outlet
from solfer.pipes import BodyMessage

RATE = 100.0
"""Largest number of transforms per second [Hz]."""

POSE = struct.Struct("<7d")
"""Translation, then quaternion (x, y, z, w)."""


class BaseTransform:
    """Broadcasts poses of bodies, at most `rate` times a second."""

    def __init__(self, rate: float = RATE):
        self._outlet = Outlet("/tf", TFMessage)
        self._period, self._next = 1.0 / rate, 0.0

    def broadcast(self, message: BodyMessage) -> None:
        """Send the pose of `message.child` in `message.frame`, unless the last one has just been sent."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = max(self._next + self._period, now)
        if self._outlet.heard():
            self._outlet.send(Frame(pack(message, rospy.Time.now()), name=None))


def pack(message: BodyMessage, now: rospy.Time) -> bytes:
    """A tf2_msgs/TFMessage with one transform."""
    frame, child = message.frame.encode(), message.child.encode()
    return b"".join((
        LENGTH.pack(1), HEADER.pack(0, now.secs, now.nsecs, len(frame)), frame, LENGTH.pack(len(child)), child,
        POSE.pack(*message.position, *message.orientation),
    ))
