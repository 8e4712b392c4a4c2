"""Which contacts touch something, as far as the robot knows."""

import numpy as np

from solfer.components.inverse_dynamics.ground import Ground
from solfer.robot import Robot

PRESSED_SHARE, BORNE_SHARE = 0.05, 0.2
"""Share of a contact's part of the weight from which on it touches something: of its measured force, and of the one
that follows from the torques of the joints, of which friction takes some."""


def touching(robot: Robot, ground: Ground) -> np.ndarray:
    """Find the contacts that bear a load, the robot being at rest, shape (c,).

    Their measured forces count; without these, those that the measured torques leave to them, h = tau + Jc' f. If
    nothing is measured, a floating base stands on all of them, and a fixed base on none.

    Args:
        robot: The Robot, updated.
        ground: Its contacts.
    """
    forces = robot.contacts.wrenches[[robot.contacts.names.index(name) for name in ground.names], :3]
    if forces.any():
        return np.linalg.norm(forces, axis=1) >= PRESSED_SHARE * ground.unit
    torque = robot.state.torque
    if not torque.any():
        return np.full(len(ground.names), robot.kinematics.base is not None)
    ground.rows.update()
    left = robot.kinematics.bias(robot.state.position, np.zeros(robot.size)) - torque
    borne, *_ = np.linalg.lstsq(ground.jacobian.T, left)
    return ground.normals @ borne >= BORNE_SHARE * ground.unit
