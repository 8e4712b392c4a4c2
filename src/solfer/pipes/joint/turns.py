"""Positions of continuous joints that go on counting where their driver begins again, as encoders modulo a turn do."""

from collections.abc import Callable
from functools import partial

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

    Attributes:
        unwrap: Adds turns to the positions of a message, shape (k,) [rad, m], of which it has a part.
        keep: Lets the next message be compared with this one, which fits.
    """

    unwrap: Callable[[np.ndarray, np.ndarray], None]
    keep: Callable[[np.ndarray, np.ndarray], None]

    def __init__(self, robot: Robot, dofs: np.ndarray, function: str, is_calibrated: bool = False):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import keep_revolutions, unwrap

        self._revolutions = robot.revolutions[dofs]
        self._dofs = dofs = np.asarray(dofs, dtype=np.int64)
        self._function = function
        self._of_robot = robot.added_revolutions
        before = np.repeat([[np.nan], [np.inf], [-np.inf]], len(dofs), axis=1)  # see the kernel
        self._added = np.zeros(len(dofs))
        self._begin = robot.state.position if function == "motor" else np.zeros(robot.size)
        self._aligned = (self._revolutions == 0.0) | (function != "motor" and not is_calibrated)
        counts = self._of_robot if function == "state" else np.zeros(robot.size)
        # what was added before is the Robot's count, or its own
        known = (self._of_robot, dofs) if function == "reference" else (self._added, np.arange(len(dofs)))
        self._add = partial(unwrap, before, self._revolutions, self._added, *known)
        self._keep = partial(keep_revolutions, before, self._added, dofs, counts)
        self._follow()

    def _follow(self) -> None:
        """Choose what each message needs: mostly a call of a kernel, once all joints are aligned."""
        is_aligned = self._aligned.all()
        self.unwrap = self._add if is_aligned else self._align
        self.keep = self._keep if is_aligned else self._keep_more

    def _align(self, position: np.ndarray, part: np.ndarray) -> None:
        """Add turns, and those that align joints."""
        self._add(position, part)
        new = self._to_align(part)
        shift = whole_revolutions(self._begin[self._dofs[new]] - position[new], self._revolutions[new])
        position[new] += shift
        self._added[new] += shift

    def _keep_more(self, position: np.ndarray, part: np.ndarray) -> None:
        """Keep positions, and which joints are aligned."""
        self._keep(position, part)
        self._aligned[self._to_align(part)] = True
        self._follow()

    def _to_align(self, part: np.ndarray) -> np.ndarray:
        """Return which joints of a message are not aligned yet, and may be: a link side at zero is not measured."""
        late = ~self._aligned[part]
        return part[late & (self._begin[self._dofs[part]] != 0.0) if self._function == "motor" else late]
