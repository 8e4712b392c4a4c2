"""What tasks accelerate without any acceleration of the joints."""

import numpy as np

from solfer.tasks import Stack


class TaskDrift:
    """dJ/dt v of a stack's rows, for whatever points its tasks have: by central differences along the velocity v.

    Args:
        stack: A stack like that of the tasks, on a twin of their Robot, with their weights.

    Attributes:
        value: dJ/dt v as of the last `update`, shape (rows,).
    """

    def __init__(self, stack: Stack):
        self._stack = stack
        self._robot = stack.robot
        self.value, self._back = np.zeros((2, len(stack.jacobian)))
        self._move = np.zeros(stack.size)
        stack.update()

    def update(self, position: np.ndarray, velocity: np.ndarray) -> None:
        """Compute `value` at a position [rad, m] and a velocity [rad/s, m/s], shape (n,) each."""
        # [s] by which the robot is moved ahead and back: errors are those of third derivatives times its square
        step = 1e-5
        np.multiply(velocity, step, out=self._move)
        for sign, out in ((1.0, self.value), (-1.0, self._back)):
            np.multiply(self._move, sign, out=self._robot.state.position)
            self._robot.state.position += position
            self._robot.update()
            self._stack.update_jacobian()
            np.dot(self._stack.jacobian, velocity, out=out)
        self.value -= self._back
        self.value /= 2.0 * step
