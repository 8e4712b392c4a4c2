"""Rolling wheels and an IMU by least squares, as ADVR's base_estimation has them."""

import math
from pathlib import Path

import numpy as np
from estimation_cases.baseline import RestingGyroscope, WheeledBody, series
from estimation_cases.log import PERIOD
from estimation_cases.measurements import Sample

from solfer.components.odometry.sensing.measured_base import rotation_vector
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.transport.messages import ImuMessage

GAIN = 0.1
"""Share of the error of the orientation that is taken away in a cycle."""


class RollingSquares:
    """The twist of the base for which the material of wheels that touch rests, and the IMU's orientation is followed.

    With the Jacobian J_i of a wheel's material at r_i and the velocities of the joints, v + w x r_i + J_i dq = 0 holds
    of each wheel that touches, by hysteresis of its force; w is the angular velocity of the IMU and a tenth of the
    orientation's error in a cycle. All of it is one problem of least squares, whose twist is integrated. As the methods
    of `odometry` do, it learns the gyroscope's bias while no joint moves; the heading of the IMU counts without it.

    Args:
        contacts: See `WheeledBody`.
        sample: The first cycle.

    Attributes:
        position: x, y, z of the base [m].
        rotation: From the base to the world, shape (3, 3).
    """

    def __init__(self, contacts: Path, sample: Sample):
        self.body, self.position = WheeledBody(contacts), np.zeros(3)
        self._gyroscope, self._drift = RestingGyroscope(), 0.0
        self.rotation = self._orientation(sample.imu)

    def _orientation(self, imu: ImuMessage) -> np.ndarray:
        righted = rotation_from_quaternion((0.0, 0.0, -math.sin(0.5 * self._drift), math.cos(0.5 * self._drift)))
        return righted @ rotation_from_quaternion(imu.orientation) @ self.body.to_imu.T

    def cycle(self, sample: Sample, forces: np.ndarray) -> None:
        """Follow what was measured; forces are normal ones on the wheels, shape (4,) [N]."""
        body = self.body
        body.touch(forces)
        body.place(self.rotation, sample.joints)
        self._gyroscope.hear(body.position, sample.imu.angular, PERIOD)
        to_world, bias = self.rotation @ body.to_imu, self._gyroscope.bias
        self._drift += float(to_world[2] @ bias) * PERIOD
        angular = to_world @ (sample.imu.angular - bias)
        angular = angular + GAIN / PERIOD * rotation_vector(self._orientation(sample.imu) @ self.rotation.T)
        velocity, angular = twist(body, angular)
        turn, mean, _ = series(angular * PERIOD)
        self.position += mean @ velocity * PERIOD
        self.rotation = turn @ self.rotation

    @property
    def pose(self) -> np.ndarray:
        """x, y, z and heading, shape (4,) [m, rad]."""
        return np.append(self.position, math.atan2(self.rotation[1, 0], self.rotation[0, 0]))


def twist(body: WheeledBody, angular: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solve for velocity and angular velocity of the base, axes of the world; `angular` is that of the IMU [rad/s]."""
    rows, measured = [np.hstack((np.zeros((3, 3)), np.eye(3)))], [angular]
    for wheel in np.flatnonzero(body.touching):
        x, y, z = body.arms[wheel]
        rows.append(np.array(((1.0, 0.0, 0.0, 0.0, z, -y), (0.0, 1.0, 0.0, -z, 0.0, x), (0.0, 0.0, 1.0, y, -x, 0.0))))
        measured.append(-body.jacobian[3 * wheel : 3 * wheel + 3] @ body.velocity)
    stacked = np.vstack(rows)
    # without wheels nothing is known of the velocity
    solved = np.linalg.lstsq(stacked, np.concatenate(measured), rcond=None)[0]
    return solved[:3], solved[3:]
