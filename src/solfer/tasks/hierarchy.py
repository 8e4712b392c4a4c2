"""Tasks of strict priority by null spaces."""

from functools import partial

import numpy as np

from solfer.numerics.blocks import MemoryBlock
from solfer.tasks.kernel import DESCENT, descend
from solfer.tasks.stack import Levels, Stack


class Descent:
    """The null-space steps of a stack, one level below the other; see `Hierarchy`.

    Args:
        stack: The levels.
        checks: Whether `slopes` are computed.

    Attributes:
        reached: Zeros, then the joint velocities after each level, shape (levels + 1, n); live.
        steps: The same without these zeros, shape (levels, n); live.
        slopes: What is left of the slope of each level's cost beside the levels before, as a ratio of its largest
            term, shape (levels,); empty without checks.
        basis: Orthonormal rows that span those of the levels but the last, with zeros for dependent ones, shape
            (rows, n).
        update: Computes all levels at the last update of the stack.
    """

    def __init__(self, stack: Stack, checks: bool):
        (rows, cols), levels = stack.jacobian.shape, len(stack.levels)
        slopes = levels if checks else 0
        largest = int(np.diff(stack.ends).max())
        self.reached = np.zeros((levels + 1, cols))
        self.steps = self.reached[1:]
        self.slopes = np.zeros(slopes)
        self.basis = np.zeros((rows, cols))
        self._block = MemoryBlock(
            DESCENT,
            rows=rows,
            cols=cols,
            levels=levels,
            largest=largest,
            height=max(rows, cols),
            slope_count=slopes,
            jacobian=stack.jacobian,
            velocity=stack.velocity,
            numbers=stack.numbers,
            ends=stack.ends,
            projected=np.zeros((max(rows, cols), cols)),
            basis=self.basis,
            square=np.zeros((largest + 1, largest)),
            work=np.zeros((3, cols)),
            reached=self.reached,
            slopes=self.slopes,
        )
        self.update = partial(descend, self._block.address)


class Hierarchy:
    """Joint velocities of levels of tasks, each in the null space of all before it.

    With dq = 0 and P = 1 at the start, each level with the weighted rows J and the desired rates r adds

        J' = J P,  dq <- dq + J'^T (J' J'^T + D^2)^-1 (r - J dq),  P <- P - W^T W,

    where the rows of W are an orthonormal basis of those of J'. The damping D keeps dq bounded where a level becomes
    singular. It does not act on P: a damped P would leave a little of the rows of earlier levels, and a level that
    contradicts them would meet an equally large inverse there, and prevail. Source: B. Siciliano, J.-J. Slotine,
    "A general framework for managing multiple tasks in highly redundant robotic systems", ICAR 1991, with the damping
    of S. Chiaverini, IEEE Transactions on Robotics and Automation 13(3), 1997.

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
        self._descent = Descent(self.stack, checks=False)
        self.velocity = self._descent.reached[-1]

    def update(self) -> np.ndarray:
        """Compute and return the joint velocities at the state of the last update of the Robot."""
        self.stack.update()
        self._descent.update()
        return self.velocity

    @property
    def smallest_singular_values(self) -> np.ndarray:
        """See `Stack.smallest_singular_values`."""
        return self.stack.smallest_singular_values
