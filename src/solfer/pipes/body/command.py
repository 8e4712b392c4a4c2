"""Operational-space command pipes: publish pose and twist of a link."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from solfer.config.records.conventions import ConventionRecord
from solfer.model import Kinematics, State
from solfer.numerics.rotations import QuaternionConvention, quaternion_from_rotation, rotation_from_quaternion
from solfer.pipes.command_pipe import CommandPipe
from solfer.transport.endpoints import Writer
from solfer.transport.messages import VECTOR_MESSAGES, BodyMessage, Message, VectorMessage

if TYPE_CHECKING:
    from solfer.numerics.twist_transport import BaseKinematics

SENT_MESSAGES = {
    "nav_msgs/Odometry": ("position", "velocity"),
    "geometry_msgs/PoseStamped": ("position",),
    "geometry_msgs/QuaternionStamped": ("position",),
    "geometry_msgs/TwistStamped": ("velocity",),
}
"""Messages that can be sent, by their canonical name, with the interfaces that each carries."""


@dataclass(frozen=True)
class PublishedLink:
    """The link that a command pipe publishes.

    Attributes:
        name: Its name.
        convention: How orientation and twist are written.
        frame: Name of the world in the messages.
        covariances: Of pose and twist, as a BodyMessage has them, shape (36,) each; live. None: not known.
    """

    name: str
    convention: ConventionRecord
    frame: str = "world"
    covariances: tuple[np.ndarray, np.ndarray] | None = None


class BodyCommandPipe(CommandPipe):
    """Publishes pose and twist of a link of the desired or the measured State.

    Args:
        name: Name of the pipe in the configuration.
        writer: Publishes the messages.
        message: Canonical name of the message, one of SENT_MESSAGES.
        kinematics: Kinematics for this pipe alone.
        state: State that is published.
        link: The link.
    """

    def __init__(
        self,
        name: str,
        writer: Writer,
        message: str,
        kinematics: Kinematics,
        state: State,
        *,
        link: PublishedLink,
    ):
        covariances = link.covariances
        convention = link.convention
        self._frame = link.frame
        self._covariances = None if covariances is None else tuple(each.reshape(6, 6) for each in covariances)
        self._state = state
        self._motion = _motion(kinematics, link.name)
        self._link = link.name
        orientation = convention.orientation
        self._convention = QuaternionConvention(orientation.order, orientation.convention)
        self._twist_frame = convention.twist.frame
        self._is_prescribed = self._convention.is_ours and self._twist_frame != "world"
        self._fill = {
            "nav_msgs/Odometry": self._fill_odometry,
            "geometry_msgs/PoseStamped": self._fill_pose,
            "geometry_msgs/QuaternionStamped": self._fill_orientation,
            "geometry_msgs/TwistStamped": self._fill_twist,
        }[message]
        super().__init__(name, writer, self._empty(message))

    def collect(self) -> None:
        """Compute pose and twist from the State, and fill the message."""
        self._motion.update(self._state.position, self._state.velocity)
        self._fill()

    def _empty(self, message: str) -> Message:
        if message == "nav_msgs/Odometry":
            return BodyMessage(self._frame, self._link)
        in_body_axes = message == "geometry_msgs/TwistStamped" and self._twist_frame == "body"
        return VectorMessage(self._link if in_body_axes else self._frame, np.zeros(VECTOR_MESSAGES[message]))

    def _fill_odometry(self) -> None:
        sent = self.sent
        motion = self._motion
        sent.position[:] = motion.position
        self._orient(sent.orientation)
        if self._is_prescribed:
            sent.linear[:] = motion.velocity[:3]
            sent.angular[:] = motion.velocity[3:]
        else:
            linear, angular = self._twist(self._twist_frame or "body")
            # the message holds the twist in world axes, as turned by a receiver that trusts its orientation
            prescribed = rotation_from_quaternion(sent.orientation)
            np.matmul(prescribed, linear, out=sent.linear)
            np.matmul(prescribed, angular, out=sent.angular)
        if self._covariances is not None:
            sent.pose_covariance[...], sent.twist_covariance[...] = self._covariances

    def _fill_pose(self) -> None:
        self.sent.values[:3] = self._motion.position
        self._orient(self.sent.values[3:])

    def _fill_orientation(self) -> None:
        self._orient(self.sent.values)

    def _fill_twist(self) -> None:
        self.sent.values[:3], self.sent.values[3:] = self._twist(self._twist_frame or "world")

    def _twist(self, frame: str) -> tuple[np.ndarray, np.ndarray]:
        """Return linear and angular velocity of the link in the axes of the world or of the body, shape (3,) each."""
        velocity = self._motion.velocity
        if frame == "world":
            return velocity[:3], velocity[3:]
        rotation = self._motion.rotation
        return velocity[:3] @ rotation, velocity[3:] @ rotation

    def _orient(self, out: np.ndarray) -> None:
        self._convention.write(quaternion_from_rotation(self._motion.rotation), out)


class _LinkMotion:
    """Pose and twist of a link in the world, see `BaseKinematics`."""

    def __init__(self, kinematics: Kinematics, link: str):
        self._kinematics = kinematics
        self._link = link
        self.rotation = np.eye(3)
        self.position = np.zeros(3)
        self.velocity = np.zeros(6)

    def update(self, position: np.ndarray, velocity: np.ndarray) -> None:
        """Compute them of the DoFs, shape (n,) each."""
        kinematics = self._kinematics
        kinematics.update(position, velocity)
        self.rotation = kinematics.rotation(self._link)
        self.position = kinematics.position(self._link)
        self.velocity = kinematics.velocity(self._link)


def _motion(kinematics: Kinematics, link: str) -> "BaseKinematics | _LinkMotion":
    # imported here: its compiler takes a while to load
    from solfer.numerics.twist_transport import BaseKinematics

    if kinematics.base is not None and link == kinematics.base_link:
        return BaseKinematics(kinematics.base)
    return _LinkMotion(kinematics, link)
