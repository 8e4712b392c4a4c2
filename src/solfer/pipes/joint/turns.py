"""Positions of continuous joints that go on counting where their driver begins again, as encoders modulo a turn do."""

import numpy as np

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
        address: What the compiled step of a message gets.
    """

    def __init__(self, robot: Robot, dofs: np.ndarray, function: str, is_calibrated: bool = False):
        # imported here: its compiler takes a while to load
        from solfer.numerics.blocks import MemoryBlock
        from solfer.pipes.joint.kernel import TURNS

        count = len(dofs)
        size = robot.size
        dofs = np.array(dofs, dtype=np.int64)
        revolutions = robot.revolutions[dofs]
        added = np.zeros(count)
        # what was added before is the Robot's count, or its own
        known, places = (robot.added_revolutions, dofs) if function == "reference" else (added, np.arange(count))
        self._block = MemoryBlock(
            TURNS,
            count=count,
            size=size,
            known_count=len(known),
            before=np.repeat([[np.nan], [np.inf], [-np.inf]], count, axis=1),  # see the kernel
            revolutions=revolutions,
            added=added,
            known=known,
            known_places=places,
            dofs=dofs,
            counts=robot.added_revolutions if function == "state" else np.zeros(size),
            aligned=(revolutions == 0.0) | (function != "motor" and not is_calibrated),
            begin=robot.state.position if function == "motor" else np.zeros(size),
            waits=function == "motor",
        )
        self.address = self._block.address
