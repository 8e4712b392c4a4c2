"""The motors of a robot."""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from solfer.model.kinematics import Kinematics
from solfer.simulation.physics import RobotInEngine

DriveState = Literal["sound", "free", "stuck"]
"""What a drive does: its work, nothing, or it holds its joint whatever is commanded."""

DRIVE_STATES = get_args(DriveState)
BRAKE = 1e5
"""Largest effort of what holds a joint that is stuck [Nm, N]."""


class BodyMotors:
    """Motors that hold a speed, and torques of all other joints.

    Args:
        robot: The robot as the engine has loaded it.
        count: Number of its joints.
        kinematics: The model.
        motors: DoFs with motors that hold a speed.
        friction: Friction of the joints [Nm, N].

    Attributes:
        rows: Joints whose motors hold a speed.
        states: What the drives of all joints do.
        measured: To be written: efforts of the motors of all joints, shape (count,) [Nm, N]; None: no motor holds a
            speed.
    """

    def __init__(
        self,
        robot: RobotInEngine,
        count: int,
        kinematics: Kinematics,
        motors: np.ndarray,
        friction: Sequence[float],
    ):
        self._robot = robot
        self._friction = friction
        self._count = count
        self._first = kinematics.size - count
        self.rows = [int(dof) - self._first for dof in motors]
        self.measured = np.zeros(count) if self.rows else None
        self._drive_torques([row for row in range(count) if row not in self.rows])
        self._motors = robot.group(self.rows)
        self._limits = tuple(np.minimum(kinematics.effort_limit[motors], 1e6).tolist())  # motors may have no limit
        self._efforts = self._limits
        self.states: list[DriveState] = ["sound"] * count
        self._stuck: list[int] = []
        self._free: list[int] = []

    def push(self) -> None:
        """Let `apply` set torques of joints with motors, too: those act beside what a motor needs to hold its speed."""
        self._drive_torques(list(range(self._count)))

    def apply(self, torque: np.ndarray, speed: np.ndarray) -> None:
        """Set what the next step does; see `Body.apply`."""
        if len(self._torque_dofs):
            self._torques.apply_torques(torque[self._torque_dofs])
        if self.rows:
            if self._stuck:
                speed[self._stuck] = 0.0
            self._motors.hold_speeds(speed, self._efforts)

    def read(self, out: np.ndarray) -> None:
        """Write the efforts of the motors that hold a speed, of those `measured` [Nm, N]."""
        assert self.measured is not None
        self.measured.take(self.rows, out=out, mode="clip")
        if self._free:
            out[self._free] = 0.0  # an engine may have that of the last step with a motor

    def change(self, row: int, state: DriveState) -> None:
        """Break the drive of a joint, or repair it; one on a torque is without power besides where it is free."""
        self.states[row] = state
        if row not in self.rows:
            effort = BRAKE if state == "stuck" else self._friction[row]
            self._robot.group([row]).hold_speeds(np.zeros(1), (effort,))
            return
        motor = self.rows.index(row)
        effort = {"sound": self._limits[motor], "free": 0.0, "stuck": BRAKE}[state]
        self._efforts = (*self._efforts[:motor], effort, *self._efforts[motor + 1 :])
        self._stuck = [number for number, each in enumerate(self.rows) if self.states[each] == "stuck"]
        self._free = [number for number, each in enumerate(self.rows) if self.states[each] == "free"]

    def _drive_torques(self, rows: list[int]) -> None:
        """Choose the joints whose torques `apply` sets."""
        self._torques = self._robot.group(rows)
        self._torque_dofs = np.array(rows, dtype=np.intp) + self._first
