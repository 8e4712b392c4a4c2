"""Default gains of robots that bring none."""

import numpy as np

from solfer.model.kinematics import Kinematics

FULL_EFFORT = 0.05
"""Deviation that calls for the whole effort [rad, m]: half of the effort lets a joint give way by half of that."""

FASTEST = 100.0
"""Largest natural frequency [rad/s]: a twentieth of a turn in a step of 1 ms, and only 0.02 rad of a free link's own
weight, g / (l w^2), on 5 cm."""

SHARE = 0.25
"""Share of the rest of a floating robot that one of its joints moves: a quadruped stands on four legs."""


def default_gains(kinematics: Kinematics, dofs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and damping with which joints hold a robot without oscillations.

    The stiffness uses the effort limit, as far as the natural frequency w = sqrt(K / I) stays below FASTEST; where
    there is no limit, that bound is the stiffness. The damping is the critical one, D = 2 sqrt(K I). I is the largest
    inertia that the joint has to move, see `moved_inertia`.

    Args:
        kinematics: Model of the robot.
        dofs: The joints' DoFs in the model.

    Returns:
        Stiffness [Nm/rad, N/m] and damping [Nms/rad, Ns/m], shape (len(dofs),) each.
    """
    inertia = moved_inertia(kinematics, dofs)
    stiffness = np.minimum(kinematics.effort_limit[dofs] / FULL_EFFORT, inertia * FASTEST**2)
    return stiffness, 2.0 * np.sqrt(stiffness * inertia)


def moved_inertia(kinematics: Kinematics, dofs: np.ndarray) -> np.ndarray:
    """Inertia about each joint's axis of what it moves, all other joints held [kg m^2, kg], shape (len(dofs),).

    On a fixed base that is what the joint carries, M_jj. A joint of a floating robot may stand on what it carries, and
    then moves its SHARE of the rest: the larger one counts. The joints are at zero, or at the limit that is next to it.
    """
    posture = np.clip(0.0, kinematics.lower_position, kinematics.upper_position)
    kinematics.update(posture)
    inertia = kinematics.inertia(posture)
    carried = inertia.diagonal()[dofs]
    if kinematics.base is None:
        return carried
    whole = np.array([_inertia_of_the_whole(kinematics, inertia, dof) for dof in dofs])
    return np.maximum(carried, SHARE * (whole - carried))


def _inertia_of_the_whole(kinematics: Kinematics, inertia: np.ndarray, dof: int) -> float:
    """Inertia of the whole robot, as one rigid body, about the axis of a joint [kg m^2, kg]."""
    link = kinematics.description.joints[kinematics.dofs[dof]].child
    twist = kinematics.jacobian(link)[:, dof].copy()
    twist[:3] += np.cross(twist[3:], kinematics.position(kinematics.base_link) - kinematics.position(link))
    rates = np.linalg.solve(kinematics.jacobian(kinematics.base_link)[:, :6], twist)
    return float(rates @ inertia[:6, :6] @ rates)
