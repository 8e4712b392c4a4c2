"""The pose of the floating base as a transform, for rviz and everything else that uses tf."""

import time

import rospy
from geometry_msgs.msg import TransformStamped
from tf2_ros import TransformBroadcaster

from solfer.pipes import BodyMessage

RATE = 100.0
"""Largest number of transforms per second [Hz]."""


class BaseTransform:
    """Broadcasts poses of bodies, at most `rate` times a second."""

    def __init__(self, rate: float = RATE):
        self._broadcaster = TransformBroadcaster()
        self._transform = TransformStamped()
        self._period, self._next = 1.0 / rate, 0.0

    def broadcast(self, message: BodyMessage) -> None:
        """Send the pose of `message.child` in `message.frame`, unless the last one has just been sent."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = max(self._next + self._period, now)
        out = self._transform
        out.header.stamp = rospy.Time.now()
        out.header.frame_id, out.child_frame_id = message.frame, message.child
        translation, rotation = out.transform.translation, out.transform.rotation
        translation.x, translation.y, translation.z = message.position.tolist()
        rotation.x, rotation.y, rotation.z, rotation.w = message.orientation.tolist()
        self._broadcaster.sendTransform(out)
