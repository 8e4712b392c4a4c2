"""Positions of continuous joints that go on counting where their driver begins again, as encoders modulo a turn do."""

import numpy as np

from solfer.numerics.rotations import whole_revolutions
from solfer.robot import Robot


class JointTurns:
    """Adds whole turns to positions of continuous joints whose driver counts within one turn.

    None of them moves by more than half a turn from one message to the next. The first position counts as it comes. A
    driver whose positions have been more than a turn apart counts on: nothing more is added. What topics carry is in
    the count of the robot's driver, `Robot.added_revolutions` is what the measured State has more.

    Args:
        robot: The Robot.
        dofs: DoFs that the pipe carries, shape (k,).
        function: That of the pipe: `state`, whose count is the Robot's, `motor` with its own, which begins on the turn
            of the link side once that is measured, or `reference`, which begins with the Robot's.
        is_calibrated: Whether a calibration says where zero is: the first position is the shortest way from there.
    """

    def __init__(self, robot: Robot, dofs: np.ndarray, function: str, is_calibrated: bool = False):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import keep_revolutions, unwrap

        self._unwrap = unwrap
        self._keep = keep_revolutions
        self._revolutions = robot.revolutions[dofs]
        self._dofs = dofs
        self._function = function
        self._of_robot = robot.added_revolutions
        self._before = np.repeat([[np.nan], [np.inf], [-np.inf]], len(dofs), axis=1)  # see the kernel
        self._added = np.zeros(len(dofs))
        self._begin = robot.state.position if function == "motor" else np.zeros(robot.size)
        self._aligned = (self._revolutions == 0.0) | (function != "motor" and not is_calibrated)

    def unwrap(self, position: np.ndarray, part: np.ndarray) -> None:
        """Add turns to the positions of a message, shape (k,) [rad, m], of which it has a `part`."""
        if self._function == "reference":
            np.take(self._of_robot, self._dofs, out=self._added, mode="clip")
        self._unwrap(position, part, self._before, self._revolutions, self._added)
        if not self._aligned.all():
            new = self._to_align(part)
            shift = whole_revolutions(self._begin[self._dofs[new]] - position[new], self._revolutions[new])
            position[new] += shift
            self._added[new] += shift

    def keep(self, position: np.ndarray, part: np.ndarray) -> None:
        """Let the next message be compared with this one, which fits."""
        self._keep(position, part, self._before, self._added)
        if not self._aligned.all():
            self._aligned[self._to_align(part)] = True
        if self._function == "state":
            self._of_robot[self._dofs] = self._added

    def _to_align(self, part: np.ndarray) -> np.ndarray:
        """Return which joints of a message are not aligned yet, and may be: a link side at zero is not measured."""
        late = ~self._aligned[part]
        return part[late & (self._begin[self._dofs[part]] != 0.0) if self._function == "motor" else late]
