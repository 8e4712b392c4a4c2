"""Viscous friction in the motors of a robot."""

import logging

import numpy as np

from solfer.lower_level.gains.defaults import free_inertia
from solfer.model.actuators import Actuators
from solfer.model.kinematics import Kinematics
from solfer.model.neutral_posture import neutral_posture
from solfer.simulation.world.engine import STEP

LARGEST = 0.5
"""Largest STEP B / m: more friction would stop a joint within a step, and more than 2 would shake it."""

logger = logging.getLogger(__name__)


def motor_friction(kinematics: Kinematics, actuators: Actuators | None) -> np.ndarray | None:
    """Compute the torque that the motor of each DoF loses for a unit of speed, shape (kinematics.size,) [Nms/rad].

    It is the damping B of the motor, as far as a step of the simulation can follow: at most LARGEST m / STEP, with the
    inertia m that the joint moves while all others are free. None if no motor has friction.

    Args:
        kinematics: Model of the robot.
        actuators: Its actuators, of all or some DoFs.
    """
    if actuators is None or not actuators.motor_damping.any():
        return None
    dofs = [kinematics.dofs.index(name) for name in actuators.dofs]
    friction = np.zeros(kinematics.size)
    friction[dofs] = actuators.motor_damping
    most = LARGEST * free_inertia(kinematics, neutral_posture(kinematics)) / STEP
    for dof in np.flatnonzero(friction > most):
        logger.warning(
            "joint '%s' has a motor damping of %g Nms/rad: simulated are %g, more than a step of %g s can follow",
            kinematics.dofs[dof],
            friction[dof],
            most[dof],
            STEP,
        )
    return np.minimum(friction, most)
