"""The Dynamic Point (section 1.4.1 of the paper): y = A x + b."""

import numpy as np

from solfer.model.view import RobotView
from solfer.points.point import Point
from solfer.points.space import Space


class DynamicPoint(Point):
    """A value y = A x + b; base class of accelerations and forces.

    `jacobian` is A, `offset` is b. A subclass says what x is, writes `self.jacobian` in `compute_jacobian`,
    `self.offset` in `compute_offset`, and `self.value` in `compute`, which comes last.

    Args:
        space: Space of the value, or its size.
        robot: The Robot.
    """

    def __init__(self, space: Space | int, robot: RobotView):
        super().__init__(space, robot)
        self._offset = np.zeros(self.rows)

    @property
    def offset(self) -> np.ndarray:
        """The offset b as of the last `update`, shape (rows,); live."""
        return self._offset

    def compute_offset(self) -> None:
        """Write the offset."""
        raise NotImplementedError(f"{type(self).__name__} has no compute_offset()")

    def update(self, jacobian: bool = True) -> None:
        """Compute the Jacobian if `jacobian`, the offset and the value, at the last update of the Robot."""
        if jacobian:
            self._clear()
            self.compute_jacobian()
        self.compute_offset()
        self.compute()
