"""Forces of the world on a robot along its DoFs, from its momentum and its torques."""

import math

import numpy as np

from solfer.components.ground_forces import kernel
from solfer.dynamics import BIAS, INERTIA
from solfer.robot import Robot


class MomentumObserver:
    """What the world adds to the torques of the joints, along the DoFs.

    With the dynamics M a + h = t + w, where t are the torques and w is what the world does, w = M a + h - t. Without a
    cut-off the robot counts as not accelerated: w = h - t. With one, w is the output of a low-pass filter of first
    order, whose input has M (v - v') / T in place of M a, with the velocities v and v' of this and of the last cycle of
    the time T. No acceleration is measured or differentiated: the filter's step response is that of the generalised
    momentum. Source: A. De Luca, R. Mattone, "Sensorless robot collision detection and hybrid force/motion control",
    Proc. IEEE ICRA, 2005.

    Args:
        robot: The Robot.
        cut_off: Cut-off frequency [Hz], or None.

    Attributes:
        value: w, shape (n,) [N, Nm]; live.
    """

    def __init__(self, robot: Robot, cut_off: float | None):
        self._robot = robot
        self._cut_off = cut_off
        dynamics = robot.dynamics
        dynamics.subscribe([BIAS] if cut_off is None else [BIAS, INERTIA])
        self._use = dynamics.manager.use
        self._bias = dynamics.bias
        self._inertia = dynamics.inertia
        self.value, self._before = np.zeros((2, robot.size))

    def start(self, torque: np.ndarray) -> None:
        """Begin, not accelerated, with the torques of now, shape (n,)."""
        self._before[:] = self._robot.state.velocity
        np.subtract(self._robot.dynamics.bias, torque, out=self.value)

    def update(self, torque: np.ndarray, period: float) -> np.ndarray:
        """Return what the world does after `period` [s] more, by the torques of now, shape (n,); live."""
        self._use(BIAS)
        if self._cut_off is None:
            return np.subtract(self._bias, torque, out=self.value)
        self._use(INERTIA)
        ratio = -math.expm1(-2.0 * math.pi * self._cut_off * period)
        velocity = self._robot.state.velocity
        kernel.observe(self._bias, torque, self._inertia, velocity, self._before, period, ratio, self.value)
        return self.value
