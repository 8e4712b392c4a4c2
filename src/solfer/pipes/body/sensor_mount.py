"""Pose and twist of a sensor on a robot, relative to its floating base."""

import numpy as np

from solfer.errors import PipeError
from solfer.model import Description, Kinematics, State
from solfer.numerics.rotations import cross


class SensorMount:
    """Pose and twist of a sensor relative to the floating base, in the axes of the base.

    The sensor is fixed to a link; joints between the link and the base are followed in every cycle, if there are any.

    Args:
        description: The robot.
        link: The link.
        state: State that holds the joints' positions and velocities.
        position: Place of the sensor on its link, shape (3,) [m]; None: the link's origin.
        rotation: Rotation from the sensor to the link, shape (3, 3); None: the link's axes.

    Attributes:
        still: Whether pose and twist never change.
        numbers: The following in one array, shape (18,).
        rotation: Rotation from the sensor to the base, shape (3, 3).
        position: Place of the sensor, shape (3,) [m].
        linear: Velocity of the sensor, shape (3,) [m/s].
        angular: Angular velocity of the sensor, shape (3,) [rad/s].

    Raises:
        UnknownName: The robot has no such link.
        PipeError: The base does not carry the link.
    """

    def __init__(
        self,
        description: Description,
        link: str,
        state: State,
        position: np.ndarray | None = None,
        rotation: np.ndarray | None = None,
    ):
        # kinematics of its own: the Robot's are of another moment, and others update them
        self._kinematics = Kinematics(description, True)
        self._link = link
        self._state = state
        self._offset = np.zeros(3) if position is None else position
        self._turn = np.eye(3) if rotation is None else rotation
        self.still = not _moving_joints(description, self._kinematics.base_link, link)
        self._q = np.zeros(state.size)
        self._v = np.zeros(state.size)
        self.numbers = np.zeros(18)
        self.rotation = self.numbers[:9].reshape(3, 3)
        self.position = self.numbers[9:12]
        self.linear = self.numbers[12:15]
        self.angular = self.numbers[15:]
        self.follow()

    def update(self) -> None:
        """Follow the joints between the base and the sensor."""
        if not self.still:
            self.follow()

    def follow(self) -> None:
        """Compute everything from the State; the base itself is held at the origin of its chart."""
        kinematics = self._kinematics
        chart = self._kinematics.base
        self._q[6:], self._v[6:] = self._state.position[6:], self._state.velocity[6:]
        kinematics.update(self._q, self._v)
        link_to_base = chart.rotation.T @ kinematics.rotation(self._link)
        lever = link_to_base @ self._offset
        np.matmul(link_to_base, self._turn, out=self.rotation)
        np.matmul(chart.rotation.T, kinematics.position(self._link) - chart.position, out=self.position)
        self.position += lever
        velocity = kinematics.velocity(self._link)
        np.matmul(chart.rotation.T, velocity[3:], out=self.angular)
        np.matmul(chart.rotation.T, velocity[:3], out=self.linear)
        self.linear += cross(self.angular, lever)


def _moving_joints(description: Description, base: str, link: str) -> list[str]:
    """List the joints between the base and a link that can move."""
    description.link(link)
    carried_by = {joint.child: joint for joint in description.joints.values()}
    moving = []
    below = link
    while below != base:
        if below not in carried_by:
            raise PipeError(
                f"the floating base, '{base}', does not carry the link '{link}'",
                expected=f"'{base}', or a link below it",
            )
        joint = carried_by[below]
        if joint.type != "fixed":
            moving.append(joint.name)
        below = joint.parent
    return moving
