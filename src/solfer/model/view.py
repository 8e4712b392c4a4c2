"""The view of a Robot that Points and dynamics get, without Pinocchio."""

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from solfer.model.kinematics import Kinematics
    from solfer.model.state import State


class RobotView(Protocol):
    """The part of a Robot that Points and dynamics use."""

    @property
    def name(self) -> str:
        """Name of the robot, for errors."""

    @property
    def kinematics(self) -> "Kinematics":
        """Kinematics of the robot."""

    @property
    def state(self) -> "State":
        """Measured state."""

    @property
    def command(self) -> "State":
        """Desired state."""

    def update(self) -> bool:
        """Bring the kinematics up to date with the state."""
