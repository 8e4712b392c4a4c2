"""Positions of continuous joints that go on counting where their driver begins again, as encoders modulo a turn do."""

import numpy as np

from solfer.robot import Robot


class JointTurns:
    """Adds whole turns to positions of continuous joints whose driver counts within one turn.

    None of them moves by more than half a turn from one message to the next. The first position counts as it comes. A
    driver whose positions have been more than a turn apart counts on: nothing more is added. What topics carry is in
    the count of the robot's driver, `Robot.added_turns` is what the measured State has more.

    Args:
        robot: The Robot.
        dofs: DoFs that the pipe carries, shape (k,).
        function: That of the pipe: `state`, whose count is the Robot's, `motor` with its own, or `reference`, which
            begins with the Robot's.
    """

    def __init__(self, robot: Robot, dofs: np.ndarray, function: str):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import keep_turns, unwrap

        self._unwrap, self._keep = unwrap, keep_turns
        self._turns, self._dofs, self._function = robot.turns[dofs], dofs, function
        self._of_robot = robot.added_turns
        self._before = np.repeat([[np.nan], [np.inf], [-np.inf]], len(dofs), axis=1)  # see the kernel
        self._added = np.zeros(len(dofs))

    def unwrap(self, position: np.ndarray, part: np.ndarray) -> None:
        """Add turns to the positions of a message, shape (k,) [rad, m], of which it has a `part`."""
        if self._function == "reference":
            np.take(self._of_robot, self._dofs, out=self._added, mode="clip")
        self._unwrap(position, part, self._before, self._turns, self._added)

    def keep(self, position: np.ndarray, part: np.ndarray) -> None:
        """Let the next message be compared with this one, which fits."""
        self._keep(position, part, self._before, self._added)
        if self._function == "state":
            self._of_robot[self._dofs] = self._added
