"""The contact-aided invariant EKF of Hartley, Ghaffari, Eustice and Grizzle (IJRR 2020) on wheels."""

import math
from pathlib import Path

import numpy as np
from estimation_cases.baseline import GRAVITY, RestingGyroscope, WheeledBody, series, skew
from estimation_cases.log import PERIOD
from estimation_cases.measurements import Sample

from solfer.numerics.rotations import rotation_from_quaternion

GYROSCOPE, ACCELEROMETER, GYROSCOPE_WALK, ACCELEROMETER_WALK = 9e-5, 1e-3, 1e-6, 1e-4
"""Densities of noise [rad/s, m/s^2 /sqrt(Hz)] and of the walks of biases [the same in a second /sqrt(s)]."""
GYROSCOPE_BIAS, ACCELEROMETER_BIAS, TILT = 5e-3, 0.02, 0.03
"""Deviations at the start: of biases [rad/s, m/s^2], and of the tilt [rad]."""
CONTACT, STANDING, KINEMATICS = 0.01, 1e-4, 1e-3
"""Density of the slip of contacts, also while no joint moves [m/s/sqrt(Hz)]; deviation of places by encoders [m]."""
CONTRADICTS = 16.3
"""Squared innovation of a contact by its covariance that is exceeded once in a thousand times (chi^2 of three)."""


class PointContacts:
    """Orientation, velocity, place, places of contacts and biases of the IMU, with the right-invariant error.

    Between two samples the IMU's angular velocity and specific force move its pose. Each contact that touches is a
    point d at rest in the world, and encoders measure where it is from the IMU: R h + p - d = 0. Wheels roll: here d
    goes on by the way that its joints measure, which is zero for a foot. Two things are added to the published filter,
    so that it can know what the others know: contacts slip less while no joint moves, which shows the gyroscope's bias,
    and a contact that contradicts what is expected begins anew.

    Args:
        contacts: See `WheeledBody`.
        sample: The first cycle.

    Attributes:
        rotation: From the IMU to the world, shape (3, 3).
        vectors: Velocity, place of the IMU, and places of the contacts in the world, shape (6, 3) [m/s, m].
        biases: Of gyroscope and accelerometer, shape (2, 3) [rad/s, m/s^2].
        covariance: Of the errors: turn, vectors, biases, in axes of the world, shape (27, 27).
    """

    def __init__(self, contacts: Path, sample: Sample):
        self.body = WheeledBody(contacts)
        self.rotation = rotation_from_quaternion(sample.imu.orientation)
        self.vectors, self.biases = np.zeros((6, 3)), np.zeros((2, 3))
        self.covariance = np.diag(
            np.repeat((TILT**2, 1e-6, 0.0, *[KINEMATICS**2] * 4, GYROSCOPE_BIAS**2, ACCELEROMETER_BIAS**2), 3)
        )
        self.covariance[2, 2] = 0.0
        self._places = self._find(sample)
        self._jacobian = self.rotation.T @ self.body.jacobian.reshape(4, 3, -1)
        self._before = self.body.position.copy()
        self.vectors[2:] = self._places @ self.rotation.T
        self._touched, self._gyroscope = np.ones(4, dtype=bool), RestingGyroscope()

    def _find(self, sample: Sample) -> np.ndarray:
        """Return where contacts are from the IMU, its axes, shape (4, 3) [m]."""
        body = self.body
        base = self.rotation @ body.to_imu.T
        body.place(base, sample.joints)
        return (body.arms - base @ body.imu) @ self.rotation

    def cycle(self, sample: Sample, forces: np.ndarray) -> None:
        """Follow what was measured; forces are normal ones on the wheels, shape (4,) [N]."""
        self.propagate(sample.imu.angular, sample.imu.acceleration, PERIOD)
        places = self._find(sample)
        jacobian = self.rotation.T @ self.body.jacobian.reshape(4, 3, -1)
        step = self.body.position - self._before
        # the way of the contact less that of the material there
        rolled = places - self._places - 0.5 * (jacobian + self._jacobian) @ step
        self.vectors[2:] += rolled @ self.rotation.T
        self._places, self._jacobian, self._before = places, jacobian, self.body.position.copy()
        self._gyroscope.hear(self.body.position, sample.imu.angular, PERIOD)
        self.body.touch(forces)
        again = self.body.touching & ~self._touched
        self._touched = self.body.touching.copy()
        for wheel in np.flatnonzero(self._touched):
            if again[wheel] or self.distance(wheel, places) > CONTRADICTS:
                self._begin(wheel, places[wheel])
        if self._touched.any():
            self.correct(np.flatnonzero(self._touched), places)

    def propagate(self, angular: np.ndarray, force: np.ndarray, period: float) -> None:
        """Go on for a time [s] with an angular velocity [rad/s] and a specific force [m/s^2] of the IMU."""
        rotation, (velocity, place, *points) = self.rotation, self.vectors
        rate, force = angular - self.biases[0], force - self.biases[1]
        linear, errors = np.zeros((27, 27)), np.eye(27)
        linear[3:6, :3], linear[6:9, 3:6] = skew(GRAVITY), np.eye(3)
        linear[:3, 21:24] = linear[3:6, 24:27] = -rotation
        for row, vector in enumerate((velocity, place, *points), 1):
            linear[3 * row : 3 * row + 3, 21:24] = -skew(vector) @ rotation
            errors[3 * row : 3 * row + 3, :3] = skew(vector) @ rotation
        for row in range(7):
            errors[3 * row : 3 * row + 3, 3 * row : 3 * row + 3] = rotation
        slip = STANDING if self._gyroscope.rests else CONTACT
        white = np.repeat(
            (GYROSCOPE, ACCELEROMETER, 0.0, *[slip] * 4, GYROSCOPE_WALK, ACCELEROMETER_WALK), 3
        )  # fmt: skip
        spread = errors * white
        move = np.eye(27) + linear * period + 0.5 * period * period * linear @ linear
        self.covariance = move @ (self.covariance + spread @ spread.T * period) @ move.T
        turn, mean, second = series(rate * period)
        self.vectors[1] = place + velocity * period + (rotation @ second @ force + 0.5 * GRAVITY) * period**2
        self.vectors[0] = velocity + (rotation @ mean @ force + GRAVITY) * period
        self.rotation = rotation @ turn

    def distance(self, wheel: int, places: np.ndarray) -> float:
        """Return the squared innovation of a contact by its covariance; `places` are those of `correct`."""
        which = slice(9 + 3 * wheel, 12 + 3 * wheel)
        innovation = self.rotation @ places[wheel] + self.vectors[1] - self.vectors[2 + wheel]
        across, covariance = self.covariance[6:9, which], self.covariance
        spread = covariance[6:9, 6:9] + covariance[which, which] - across - across.T + KINEMATICS**2 * np.eye(3)
        return float(innovation @ np.linalg.solve(spread, innovation))

    def correct(self, wheels: np.ndarray, places: np.ndarray) -> None:
        """Take where contacts of wheels are from the IMU, its axes, shape (4, 3) [m]."""
        rows = np.zeros((3 * len(wheels), 27))
        innovation = np.zeros(3 * len(wheels))
        for row, wheel in enumerate(wheels.tolist()):
            rows[3 * row : 3 * row + 3, 6:9] = -np.eye(3)
            rows[3 * row : 3 * row + 3, 9 + 3 * wheel : 12 + 3 * wheel] = np.eye(3)
            innovation[3 * row : 3 * row + 3] = (
                self.rotation @ places[wheel] + self.vectors[1] - self.vectors[2 + wheel]
            )
        mapped = self.covariance @ rows.T
        spread = rows @ mapped + KINEMATICS**2 * np.eye(len(rows))
        gain = np.linalg.solve(spread, mapped.T).T
        step = gain @ innovation
        turn, mean, _ = series(step[:3])
        self.rotation = turn @ self.rotation
        self.vectors = self.vectors @ turn.T + step[3:21].reshape(6, 3) @ mean.T
        self.biases += step[21:].reshape(2, 3)
        kept = np.eye(27) - gain @ rows
        self.covariance = kept @ self.covariance @ kept.T + KINEMATICS**2 * gain @ gain.T

    def _begin(self, wheel: int, place: np.ndarray) -> None:
        """Begin anew with a contact that touches again."""
        self.vectors[2 + wheel] = self.vectors[1] + self.rotation @ place
        which = slice(9 + 3 * wheel, 12 + 3 * wheel)
        self.covariance[which] = self.covariance[6:9]
        self.covariance[:, which] = self.covariance[:, 6:9]
        self.covariance[which, which] += KINEMATICS**2 * np.eye(3)

    @property
    def pose(self) -> np.ndarray:
        """x, y, z and heading of the base, shape (4,) [m, rad]."""
        base = self.rotation @ self.body.to_imu.T
        return np.append(self.vectors[1] - base @ self.body.imu, math.atan2(base[1, 0], base[0, 0]))
