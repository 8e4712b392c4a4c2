"""Orientation from gyroscopes and accelerometers, as an inertial measurement unit computes it."""

import math

import numpy as np

from solfer.numerics.rotations import cross, rotation_from_quaternion

LOWEST_SPECIFIC_FORCE = 5.0
"""Specific force below which gyroscopes count alone [m/s^2]: half the weight. What is left of it in a fall points
anywhere, and a filter that began with it would learn a bias that is none, and be tilted for half a minute."""


class AttitudeFilter:
    """A complementary filter: gyroscopes predict the orientation, and specific force, upwards on average, corrects it.

    With the direction u of the specific force in the sensor's axes, and the estimate R of its orientation:

        e = u x R^T z      R' = R [w - b + e / T]x      b' = - e / (T Ti)

    The heading is that of the gyroscopes alone and drifts with their bias about the vertical. A constant bias about
    other axes tilts the orientation by `bias * T`, until it is learned within some Ti. Over a period the
    gains are those of exponential decays, so that slow samples do not make the filter unstable. Without weight the
    gyroscopes count alone.

    Source: R. Mahony, T. Hamel, J.-M. Pflimlin, "Nonlinear Complementary Filters on the Special Orthogonal Group", IEEE
    Transactions on Automatic Control 53(5), 2008.

    Args:
        time_constant: T, in which a wrong tilt decays [s].
        bias_time: Ti, in which a bias of the gyroscopes is learned [s].

    Attributes:
        rotation: Estimate R, from the sensor's axes to the world's, shape (3, 3).
        bias: Estimate b of the gyroscopes' bias [rad/s], shape (3,).
    """

    def __init__(self, time_constant: float, bias_time: float):
        self._time_constant = time_constant
        self._bias_time = bias_time
        self.rotation = np.eye(3)
        self.bias = np.zeros(3)

    def start(self, rotation: np.ndarray, force: np.ndarray) -> None:
        """Begin with the heading of a rotation, shape (3, 3), and the tilt of a specific force, shape (3,) [m/s^2].

        Without weight it begins with the rotation.
        """
        self.bias[:] = 0.0
        self.rotation[:] = rotation
        size = float(np.linalg.norm(force))
        if size < LOWEST_SPECIFIC_FORCE:
            return
        direction = rotation @ force / size
        axis = np.array([direction[1], -direction[0], 0.0])  # direction x z, which rotates `direction` upwards
        sine = float(np.linalg.norm(axis))
        angle = math.atan2(sine, float(direction[2]))
        self.rotation[:] = _rotation(axis * (angle / sine if sine > 0.0 else 0.0)) @ rotation

    def update(self, angular: np.ndarray, force: np.ndarray, dt: float) -> None:
        """Let `dt` [s] pass with an angular velocity [rad/s] and a specific force [m/s^2] in the sensor's axes."""
        predicted = self.rotation @ _rotation(dt * (angular - self.bias))
        size = float(np.linalg.norm(force))
        error = cross(force / size, predicted[2]) if size >= LOWEST_SPECIFIC_FORCE else np.zeros(3)
        correction = -math.expm1(-dt / self._time_constant) * error
        self.bias += math.expm1(-dt / self._bias_time) / dt * correction
        self.rotation[:] = predicted @ _rotation(correction)


def _rotation(vector: np.ndarray) -> np.ndarray:
    """Return the rotation about a vector by its length [rad], shape (3, 3)."""
    half = 0.5 * float(np.linalg.norm(vector))
    scale = 0.5 if half == 0.0 else 0.5 * math.sin(half) / half
    return rotation_from_quaternion((*(scale * vector), math.cos(half)))
