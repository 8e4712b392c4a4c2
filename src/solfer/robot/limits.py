"""Limits of a Robot's DoFs as States (section 1.1.2 of the paper)."""

import numpy as np

from solfer.model import Kinematics, State


def joint_limits(kinematics: Kinematics) -> tuple[State, State]:
    """Lower and upper limits as the URDF has them: -inf and inf where it has none, as for every acceleration."""
    lower, upper = State(kinematics.dofs), State(kinematics.dofs)
    lower.position, upper.position = kinematics.lower_position, kinematics.upper_position
    lower.velocity, upper.velocity = -kinematics.velocity_limit, kinematics.velocity_limit
    lower.torque, upper.torque = -kinematics.effort_limit, kinematics.effort_limit
    unlimited = np.full(kinematics.size, np.inf)
    lower.acceleration, upper.acceleration = -unlimited, unlimited
    return lower, upper
