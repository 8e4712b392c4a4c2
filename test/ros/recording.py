"""What nodes published in simulated time, by the number of the simulation's step."""

from typing import NamedTuple

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from system import numbers

from solfer.msg import JointCommand

STEP = 0.001
"""Step of the simulation [s]."""

QUEUE = 10_000


def step_of(stamp: rospy.Time) -> int:
    """Compute the number of the simulation's step at a ROS time."""
    return round(stamp.to_sec() / STEP)


class Commanded(NamedTuple):
    """What a node commands of joints at a step: positions and velocities by name, as far as it sends them."""

    step: int
    position: dict[str, float]
    velocity: dict[str, float]


class Recording:
    """Subscribes to what a simulated robot measures and what plugins command.

    Args:
        topics: Topics of solfer/JointCommand.

    Attributes:
        names: Joints, in the order of `joints`.
    """

    def __init__(self, topics: tuple[str, ...]):
        self.names: tuple[str, ...] = ()
        self._joints: dict[int, np.ndarray] = {}
        self._base: dict[int, np.ndarray] = {}
        self._commanded: dict[tuple[str, str], list[Commanded]] = {}
        self._subscribers = [
            rospy.Subscriber("/joint_states", JointState, self._receive_joints, queue_size=QUEUE, tcp_nodelay=True),
            rospy.Subscriber("/floating_base", Odometry, self._receive_base, queue_size=QUEUE, tcp_nodelay=True),
            *(
                rospy.Subscriber(topic, JointCommand, self._receive_wanted, topic, queue_size=QUEUE, tcp_nodelay=True)
                for topic in topics
            ),
        ]

    @property
    def joints(self) -> dict[int, np.ndarray]:
        """Positions and velocities by step, shape (2, n); a copy, since rospy's threads go on writing."""
        return dict(self._joints)

    @property
    def base(self) -> dict[int, np.ndarray]:
        """Position and quaternion of the base by step, shape (7,); a copy."""
        return dict(self._base)

    def close(self) -> None:
        """Hear nothing any more."""
        for subscriber in self._subscribers:
            subscriber.unregister()

    def commanded(self, topic: str, sender: str) -> list[Commanded]:
        """Return what a node has published on a topic so far."""
        return list(self._commanded.get((topic, sender), ()))

    def rests(self, topic: str, sender: str) -> bool:
        """Return whether the last two messages of a node are equal."""
        commanded = self.commanded(topic, sender)
        return len(commanded) > 1 and commanded[-1][1:] == commanded[-2][1:]

    def begins(self, topic: str, sender: str) -> list[int]:
        """Find the steps at which the references of a node at rest began to move."""
        commanded = self.commanded(topic, sender)
        news = [one[1:] != other[1:] for one, other in zip(commanded, commanded[1:], strict=False)]
        return [commanded[index + 1].step for index, new in enumerate(news) if new and not (index and news[index - 1])]

    def position(self, joint: str, step: int) -> float:
        """Measured position of a joint [rad]."""
        return self._joints[step][0, self.names.index(joint)]

    def _receive_joints(self, message: JointState) -> None:
        self.names = tuple(message.name)
        self._joints[step_of(message.header.stamp)] = np.array([message.position, message.velocity])

    def _receive_base(self, message: Odometry) -> None:
        pose = message.pose.pose
        self._base[step_of(message.header.stamp)] = np.concatenate([numbers(pose.position), numbers(pose.orientation)])

    def _receive_wanted(self, message: JointCommand, topic: str) -> None:
        commanded = Commanded(
            step_of(message.header.stamp),
            *(dict(zip(message.name, values, strict=False)) for values in (message.position, message.velocity)),
        )
        self._commanded.setdefault((topic, message._connection_header["callerid"]), []).append(commanded)
