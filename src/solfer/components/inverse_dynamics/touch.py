"""Which contacts touch something, as far as the robot knows."""

import numpy as np

from solfer.components.inverse_dynamics.ground import Ground
from solfer.robot import Robot


def touching(robot: Robot, ground: Ground) -> np.ndarray:
    """Find the contacts that bear a load, the robot being at rest, shape (c,).

    Their measured forces count; without these, those that the measured torques leave to them, h = tau + Jc' f. If
    nothing is measured, a floating base stands on all of them, and a fixed base on none.

    Args:
        robot: The Robot, updated.
        ground: Its contacts.
    """
    forces = robot.contacts.wrenches[[robot.contacts.names.index(name) for name in ground.names], :3]
    if forces.any():  # a twentieth of a contact's part of the weight
        return np.linalg.norm(forces, axis=1) >= 0.05 * ground.unit
    torque = robot.state.torque
    if not torque.any():
        return np.full(len(ground.names), robot.kinematics.base is not None)
    ground.rows.update()
    left = robot.kinematics.bias(robot.state.position, np.zeros(robot.size)) - torque
    borne, *_ = np.linalg.lstsq(ground.jacobian.T, left)
    return ground.normals @ borne >= 0.2 * ground.unit  # a fifth: friction takes some of the torques
