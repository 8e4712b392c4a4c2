"""What is recorded of a component that drives."""

from typing import Any

import numpy as np

from solfer.components.wheeled_motion.joints import CommandedJoints
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.steering import Steering
from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.robot import Robot


class WheelsLog:
    """Declares references, vertices, steering and errors, and measures what the cycle does not.

    Args:
        robot: The Robot.
        wheels: Its wheels.
        references: What is desired.
        steering: Which way wheels point, and are to point.
        joints: What is commanded.
    """

    def __init__(
        self, robot: Robot, wheels: DrivenWheels, references: References, steering: Steering, joints: CommandedJoints
    ):
        self._robot = robot
        self._wheels = wheels
        self._references = references
        self._steering = steering
        self._joints = joints
        self._base_error, self._velocity = np.zeros((2, 3))
        self._vertex_error = np.zeros_like(references.vertices)

    def start(self, logger: Any) -> None:
        """Declare what is recorded."""
        names = self._wheels.links
        places = [f"{name}.{axis}" for name in names for axis in "xyz"]
        logger.add("base_reference", self._references.position, list("xyz"), "m", "world")
        logger.add("vertex_reference", self._references.vertices, places, "m")
        logger.add("vertices", self._wheels.offsets.states, places, "m")
        logger.add("steering_reference", self._steering.angles, names, "rad")
        logger.add("steering", self._steering.measured, names, "rad")
        logger.add("velocity", self._joints.velocity, self._robot.dofs)
        logger.add("base_error", self._base_error, list("xyz"), "m", "world")
        logger.add("vertex_error", self._vertex_error, places, "m")
        logger.add("base_velocity", self._velocity, list("xyz"), "m/s", "world")
        logger.add("base_velocity_reference", self._references.velocity, list("xyz"), "m/s", "world")

    def measure(self) -> None:
        """Find how far base and vertices are from their references, and how fast the base moves."""
        np.subtract(self._references.position, self._wheels.place, out=self._base_error)
        self._base_error[2] += self._references.rise
        np.subtract(self._references.vertices, self._wheels.offsets.states, out=self._vertex_error)
        np.dot(self._wheels.pose.jacobian[:3], self._robot.state.velocity, out=self._velocity)
