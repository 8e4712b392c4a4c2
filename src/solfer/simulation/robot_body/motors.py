"""The motors of a robot in a PyBullet world."""

from collections.abc import Sequence

import numpy as np

from solfer.model.kinematics import Kinematics
from solfer.simulation.world.engine import Engine

LARGEST_EFFORT = 1e6  # [Nm], of motors without a limit


class BodyMotors:
    """Motors that hold a speed, and torques of all other joints. Only friction is left to PyBullet's other motors.

    Args:
        engine: The world.
        body: Number of the body.
        indices: PyBullet's numbers of the joints, in the model's order.
        kinematics: The model.
        motors: DoFs with motors that hold a speed.
        losses: Friction of each joint [Nm].

    Attributes:
        rows: Joints whose motors hold a speed.
    """

    def __init__(
        self,
        engine: Engine,
        body: int,
        indices: Sequence[int],
        kinematics: Kinematics,
        motors: np.ndarray,
        *,
        losses: Sequence[float],
    ):
        self._bullet = engine.bullet
        self._client = engine.client
        self._body = body
        self._joints = list(indices)
        self._first = kinematics.size - len(indices)
        self._torque_dofs = np.array(
            [dof for dof in range(self._first, kinematics.size) if dof not in motors], dtype=np.intp
        )
        self._torque_indices = [indices[dof - self._first] for dof in self._torque_dofs]
        self.rows = [int(dof) - self._first for dof in motors]
        self._indices = [indices[row] for row in self.rows]
        self._efforts = np.minimum(kinematics.effort_limit[motors], LARGEST_EFFORT).tolist()
        self._bullet.setJointMotorControlArray(
            body, self._joints, self._bullet.VELOCITY_CONTROL, forces=losses, physicsClientId=self._client
        )

    def push(self) -> None:
        """Let `apply` set torques of joints with motors, too: those act beside what a motor needs to hold its speed."""
        self._torque_dofs = np.arange(self._first, self._first + len(self._joints))
        self._torque_indices = list(self._joints)

    def apply(self, torque: np.ndarray, speed: np.ndarray) -> None:
        """Set what the next step does; see `Body.apply`."""
        if self._torque_indices:
            self._bullet.setJointMotorControlArray(
                self._body,
                self._torque_indices,
                self._bullet.TORQUE_CONTROL,
                forces=torque[self._torque_dofs].tolist(),
                physicsClientId=self._client,
            )
        if self._indices:
            self._bullet.setJointMotorControlArray(
                self._body,
                self._indices,
                self._bullet.VELOCITY_CONTROL,
                targetVelocities=speed.tolist(),
                forces=self._efforts,
                physicsClientId=self._client,
            )
