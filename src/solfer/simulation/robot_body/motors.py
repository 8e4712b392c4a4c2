"""The motors of a robot."""

import numpy as np

from solfer.model.kinematics import Kinematics
from solfer.simulation.physics import RobotInEngine


class BodyMotors:
    """Motors that hold a speed, and torques of all other joints.

    Args:
        robot: The robot as the engine has loaded it.
        count: Number of its joints.
        kinematics: The model.
        motors: DoFs with motors that hold a speed.

    Attributes:
        rows: Joints whose motors hold a speed.
    """

    def __init__(self, robot: RobotInEngine, count: int, kinematics: Kinematics, motors: np.ndarray):
        self._robot = robot
        self._count = count
        self._first = kinematics.size - count
        self.rows = [int(dof) - self._first for dof in motors]
        self._drive_torques([row for row in range(count) if row not in self.rows])
        self._motors = robot.group(self.rows)
        self._efforts = np.minimum(kinematics.effort_limit[motors], 1e6).tolist()  # motors may have no limit

    def push(self) -> None:
        """Let `apply` set torques of joints with motors, too: those act beside what a motor needs to hold its speed."""
        self._drive_torques(list(range(self._count)))

    def apply(self, torque: np.ndarray, speed: np.ndarray) -> None:
        """Set what the next step does; see `Body.apply`."""
        if len(self._torque_dofs):
            self._torques.apply_torques(torque[self._torque_dofs])
        if self.rows:
            self._motors.hold_speeds(speed, self._efforts)

    def _drive_torques(self, rows: list[int]) -> None:
        """Choose the joints whose torques `apply` sets."""
        self._torques = self._robot.group(rows)
        self._torque_dofs = np.array(rows, dtype=np.intp) + self._first
