"""Waves with both hands: a third party that publishes references of inverse kinematics."""

import math
from collections.abc import Mapping

import numpy as np

from solfer.robot import Robot
from solfer.transport import Middleware
from solfer.transport.messages import VectorMessage
from solfer_tools.demo.record import TopicRecorder

FRAME = "pelvis"
"""Link from which the hands are seen."""

HANDS = {"left": "arm1_7", "right": "arm2_7"}
"""Links of the hands, by the tasks that move them."""


class Waving:
    """Publishes references of both hands: they rise, and go along circles across the view, against each other.

    Args:
        middleware: Carries them, on the topics `<target>/left/reference` and `<target>/right/reference`.
        target: Name of the module that moves the hands.
        begin: Where the hands are, as seen from the base, by task, each of shape (3,) [m].

    Attributes:
        desired: What was published last, by task, each of shape (3,) [m].
    """

    def __init__(self, middleware: Middleware, target: str, begin: Mapping[str, np.ndarray]):
        self._begin = dict(begin)
        self.desired = {name: np.array(place, float) for name, place in begin.items()}
        self._messages = {name: VectorMessage(FRAME, self.desired[name]) for name in begin}
        self._writers = {
            name: middleware.writer(f"{target}/{name}/reference", "geometry_msgs/PointStamped") for name in begin
        }
        self._now = middleware.now

    def send(self, passed: float) -> None:
        """Publish where the hands are to be `passed` [s] after the beginning, in the robot's time."""
        radius = 0.1  # [m]
        period = 3.0  # of the circles [s]
        rise = min(max(passed / 2.0, 0.0), 1.0)
        rise *= rise * (3.0 - 2.0 * rise)
        angle = math.tau * passed / period
        for side, (name, begin) in zip((1.0, -1.0), self._begin.items(), strict=True):
            circle = (0.0, radius * math.sin(angle), side * radius * math.cos(angle))
            offset = np.array((-0.05, side * 0.08, 0.25)) + circle  # the centre: forward, outward, upward
            self.desired[name][:] = begin + rise * offset
            self._messages[name].stamp = self._now()
            self._writers[name].write(self._messages[name])


def robot_time(recorder: TopicRecorder) -> float:
    """Return the time of the newest measurement by the robot's clock [s].

    Hands wave by it: in a simulation that is slower than the clock of those who command it they would be rushed.
    """
    newest = recorder.newest("measured")
    return 0.0 if newest is None else newest.stamp


def hands_of(robot: Robot) -> dict[str, np.ndarray]:
    """Return where the hands are as seen from the base, by task, each of shape (3,) [m]; the Robot is up to date."""
    kinematics = robot.kinematics
    place = kinematics.position(FRAME)
    rotation = kinematics.rotation(FRAME)
    return {name: rotation.T @ (kinematics.position(link) - place) for name, link in HANDS.items()}
