"""What published methods have in common here: a robot of their own, its wheels, and which of them touch."""

from pathlib import Path

import numpy as np
from estimation_cases.log import ROBOT

from solfer.components.odometry.wheels import Wheels
from solfer.numerics.base_chart import BaseChart
from solfer.robot import Robot
from solfer.transport.messages import JointMessage

ABOVE, BELOW = 100.0, 50.0
"""Normal forces above which a wheel touches, and below which it does so no more [N], as in base_estimation."""
REST = 0.06
"""Speed of all joints below which a robot rests [rad/s], as the tag `rest` of `odometry` has it."""
GRAVITY = np.array((0.0, 0.0, -9.81))


class WheeledBody:
    """CENTAURO by its measured joints, whose base is at the origin of the world, on level ground.

    Args:
        contacts: File of the contacts, with the radii of the wheels that are believed.

    Attributes:
        arms: From the base to the contacts, axes of the world, shape (4, 3) [m].
        jacobian: From velocities of the joints to those of the wheels' material there, shape (12, joints).
        position, velocity: Of the joints, shape (joints,).
        to_imu: Rotation from the IMU to the base, shape (3, 3).
        imu: Place of the IMU from the base, its axes [m].
        touching: Which wheels touch, shape (4,).
        legs: Which joints are those of legs, or others that do not roll, shape (joints,).
    """

    def __init__(self, contacts: Path):
        self._robot = robot = Robot.load(ROBOT / "centauro.urdf", ROBOT / "centauro.srdf", contacts=contacts)
        self._wheels = wheels = Wheels(robot, "wheels", None, "")
        self._chart = robot.kinematics.base or BaseChart()
        self._order: list[int] = []
        self.arms, self.jacobian, self.position, self.velocity = (
            wheels.arms, wheels.jacobian, wheels.position, wheels.velocity,
        )  # fmt: skip
        robot.update()
        base = robot.kinematics.base_link or ""
        turn = robot.kinematics.rotation(base).T
        self.to_imu = turn @ robot.kinematics.rotation("imu_link")
        self.imu = turn @ (robot.kinematics.position("imu_link") - robot.kinematics.position(base))
        self.touching, self.legs = np.ones(4, dtype=bool), wheels.legs

    def place(self, rotation: np.ndarray, joints: JointMessage) -> None:
        """Take what was measured of the joints, with the base in a rotation to the world."""
        state = self._robot.state
        if not self._order:
            self._order = [joints.names.index(name) for name in self._robot.dofs[6:]]
        assert joints.position is not None and joints.velocity is not None
        state.position[6:], state.velocity[6:] = joints.position[self._order], joints.velocity[self._order]
        self._chart.from_rotation(np.zeros(3), rotation, state.position[:6])
        self._robot.update()
        self._wheels.update(0.0)

    def touch(self, forces: np.ndarray) -> None:
        """Find out which wheels touch by their normal forces, shape (4,) [N]."""
        self.touching = np.where(self.touching, forces > BELOW, forces > ABOVE)


class RestingGyroscope:
    """What a gyroscope measures of a robot that rests: the mean of it is its bias, as programs of real robots learn it.

    Attributes:
        bias: Axes of the sensor, shape (3,) [rad/s].
        rests: Whether no joint moves.
    """

    def __init__(self) -> None:
        self.bias, self.rests, self._count, self._before = np.zeros(3), False, 0, np.zeros(0)

    def hear(self, position: np.ndarray, angular: np.ndarray, period: float) -> None:
        """Take positions of joints [rad] and what the gyroscope measures [rad/s], after a period [s]."""
        known = len(self._before) > 0
        self.rests = known and float(np.abs(position - self._before).max()) <= REST * period
        self._before = position.copy()
        if self.rests:
            self._count += 1
            self.bias += (angular - self.bias) / self._count


def skew(vector: np.ndarray) -> np.ndarray:
    """Return the matrix of a cross product, shape (3, 3)."""
    x, y, z = vector
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def series(turn: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sums of (turn x)^n / (n + m)! for m = 0, 1, 2: rotation, its mean, and the mean of the means."""
    angle, matrix = float(np.linalg.norm(turn)), skew(turn)
    square = matrix @ matrix
    if angle < 1e-4:  # the next terms are below the last digit
        a, b, c, d, e = 1.0 - angle**2 / 6.0, 0.5 - angle**2 / 24.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 6.0
    else:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2
        c = e = (angle - np.sin(angle)) / angle**3
        d = (0.5 * angle**2 - 1.0 + np.cos(angle)) / angle**4
    eye = np.eye(3)
    return eye + a * matrix + b * square, eye + b * matrix + c * square, 0.5 * eye + e * matrix + d * square
