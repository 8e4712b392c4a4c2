"""What plugins have published in simulated time, number by number."""

import numpy as np
import rospy
from recording import QUEUE, step_of

from solfer.msg import JointCommand, RobotPoints

FIELDS = ("position", "velocity", "effort")

POINTS = ("/reaction_forces",)
"""Topics of Robot Points; others carry joints."""


def points_of(message):
    """Return the numbers of a message of Robot Points by name and index."""
    values = np.reshape(message.value, (message.count, -1))
    return {("values", message.name[row], column): values[row, column] for row, column in np.ndindex(values.shape)}


def joints_of(message):
    """Return the numbers of a message of joints by field and name; a field that is empty is not carried."""
    carried = [field for field in FIELDS if getattr(message, field)]
    return {
        (field, name): x for field in carried for name, x in zip(message.name, getattr(message, field), strict=True)
    }


class Sent:
    """What plugins have published: for each topic, by step, its numbers by plugin, pipe, field and name.

    Args:
        topics: Topics, each with the plugin that publishes there and its pipe.
    """

    def __init__(self, topics: dict[str, tuple[str, str]]):
        self._topics, self._numbers = topics, {topic: {} for topic in topics}
        self._subscribers = [
            rospy.Subscriber(topic, RobotPoints if topic in POINTS else JointCommand, self._receive, topic, QUEUE)
            for topic in topics
        ]

    def on(self, topic):
        """Return the numbers by step; a copy, since rospy's threads go on writing."""
        return dict(self._numbers[topic])

    def _receive(self, message, topic):
        numbers = points_of(message) if isinstance(message, RobotPoints) else joints_of(message)
        pipe = self._topics[topic]
        self._numbers[topic][step_of(message.header.stamp)] = {(*pipe, *key): x for key, x in numbers.items()}
