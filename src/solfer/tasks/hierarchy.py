"""Tasks of strict priority by null spaces."""

import numpy as np

from solfer.tasks.kernel import descend
from solfer.tasks.stack import Levels, Stack


class Hierarchy:
    """Joint velocities of levels of tasks, each in the null space of all before it.

    With P = 1 and dq = 0 at the start, each level with the weighted rows J and the desired rates r adds

        J' = J P,  J'# = J'^T (J' J'^T + D^2)^-1,  dq <- dq + J'# (r - J dq),  P <- P - J'# J'.

    Source: S. Chiaverini, IEEE Transactions on Robotics and Automation 13(3), 1997, with the projection of all earlier
    levels at once as in B. Siciliano, J.-J. Slotine, "A general framework for managing multiple tasks in highly
    redundant robotic systems", ICAR 1991. The damping D keeps dq bounded where a level becomes singular; it lets a
    later level disturb an earlier one by no more than D / 2 of what it asks for, and by D^2 away from singularities.

    Args:
        levels: Tasks, or groups of tasks that are weighed against each other; the most important first.

    Attributes:
        stack: The levels.
        velocity: Joint velocities dq as of the last `update`, shape (n,) [rad/s, m/s]; live.

    Raises:
        TaskError: See `Stack`.
    """

    def __init__(self, levels: Levels):
        self.stack = Stack(levels)
        rows, cols = self.stack.jacobian.shape
        self.velocity = np.zeros(cols)
        self._projected, self._basis = np.zeros((rows, cols)), np.zeros((rows, cols))
        largest = int(np.diff(self.stack.ends).max())
        # the factor L of a level, then its residual
        self._square = np.zeros((largest + 1, largest))

    def update(self) -> np.ndarray:
        """Compute and return the joint velocities at the state of the last update of the Robot."""
        stack = self.stack
        stack.update()
        descend(stack.jacobian, stack.velocity, stack.numbers, stack.ends, self._projected, self._basis, self._square,
                self.velocity)
        return self.velocity

    @property
    def smallest_singular_values(self) -> np.ndarray:
        """Smallest singular value of J P of each level as of the last `update`, shape (levels,); computed when asked.

        It is small where the level's tasks contradict each other or those before it, and near kinematic singularities.
        """
        return smallest_singular_values(self._projected, self.stack.ends)


def smallest_singular_values(matrix: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Smallest singular value of each block of rows that begins at `ends[k]`, shape (len(ends) - 1,)."""
    blocks = zip(ends[:-1], ends[1:], strict=True)
    return np.array([np.linalg.svd(matrix[start:end], compute_uv=False)[-1] for start, end in blocks])
