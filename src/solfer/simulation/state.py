"""What a simulated robot does, as its sensors and pushes see it: read-only."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from solfer.model.kinematics import Kinematics, read_only
from solfer.simulation.physics import ContactPoint


class Moment:
    """What the DoFs and links of a robot do at one moment; all arrays are live and read-only.

    Where the links are is computed at the first question after each change; what is returned then holds until the next.

    Args:
        kinematics: Model of the robot, for this object alone.
        q, v, torque: See `Simulation`.

    Attributes:
        q, v, torque: Position, velocity and torque of the model's DoFs, those of a floating base included, shape (model
            size,).
        gravity: Acceleration of gravity in world axes, shape (3,) [m/s^2].
    """

    def __init__(self, kinematics: Kinematics, q: np.ndarray, v: np.ndarray, torque: np.ndarray):
        self.q, self.v, self.torque = read_only(q), read_only(v), read_only(torque)
        self._kinematics, self.gravity = kinematics, read_only(kinematics.gravity)
        self._current = False

    def expire(self) -> None:
        """Note that the numbers have changed."""
        self._current = False

    def require(self, link: str, where: str = "") -> None:
        """Check that the robot has a link; an UnknownName at `where` otherwise."""
        self._kinematics.frame(link, where)

    def position(self, link: str) -> np.ndarray:
        """Return the position of a link's origin in the world, shape (3,) [m]."""
        return self._at_present().position(link)

    def rotation(self, link: str) -> np.ndarray:
        """Return the rotation from a link to the world, shape (3, 3)."""
        return self._at_present().rotation(link)

    def velocity(self, link: str) -> np.ndarray:
        """Compute the velocity of a link's origin and its angular velocity in world axes, shape (6,); a new array."""
        return self._at_present().velocity(link)

    def _at_present(self) -> Kinematics:
        if not self._current:
            self._kinematics.update(self.q, self.v)
            self._current = True
        return self._kinematics


@dataclass(frozen=True)
class BaseMotion:
    """Pose and twist of the base link's origin in the world; live arrays, see `Body`."""

    link: str
    position: np.ndarray
    orientation: np.ndarray
    linear: np.ndarray
    angular: np.ndarray


@dataclass(frozen=True)
class MotorSide:
    """What the motors behind the joints' springs do, as seen behind their gears; live arrays of all DoFs.

    Attributes:
        two_mass: Which DoFs have motors with a motion of their own; for others `position` and `velocity` mean nothing.
        position, velocity: Of these motors [rad], [rad/s].
        compliance: What the springs of other DoFs yield, zero without a spring [rad/Nm].
    """

    two_mass: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    compliance: np.ndarray


@dataclass(frozen=True)
class SimulationState:
    """What a simulated robot does, read-only.

    Attributes:
        joints: Names of the joints, the last of the model's DoFs.
        owner: For each link, the link that it is fixed to, under whose name `contact_points` lists it.
        base: Motion of a floating base; None: it is fixed.
        now: What it does after the newest step.
        before: What it did at the beginning of that step.
        contact_points: Lists the points at which the world pushed the robot in that step.
        clock: Reads the simulated time [s].
        motors: The motors behind springs; None: no joint has a spring.
    """

    joints: tuple[str, ...]
    owner: Mapping[str, str]
    base: BaseMotion | None
    now: Moment
    before: Moment
    contact_points: Callable[[], list[ContactPoint]]
    clock: Callable[[], float]
    motors: MotorSide | None = None

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.clock()

    def of_joints(self, numbers: np.ndarray) -> np.ndarray:
        """Return the joints' part of numbers of all DoFs, a view, shape (len(joints),)."""
        return numbers[len(numbers) - len(self.joints) :]
