"""Default gains of robots without gains of their own."""

import numpy as np

from solfer.lower_level.laws.springs import REGULARISATION
from solfer.model.kinematics import Kinematics
from solfer.model.neutral_posture import neutral_posture

DRIVE_PERIOD = 0.001
"""Period of the drives [s]."""


def default_gains(
    kinematics: Kinematics, dofs: np.ndarray, posture: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Compute stiffness and damping with which joints hold a robot without oscillations, in the air and on the ground.

    With the effort limit tau, the torque g of the weight that hangs on the joint, the dry friction f that the
    description gives it, and I from `moved_inertia`:

        K = max(tau / effort_deflection, |g| / weight_deflection), but at most I top_frequency^2,
            then at least f / friction_deflection, but at most m free_top_frequency^2
        D = min(2 sqrt(K I), largest_loss m / DRIVE_PERIOD),   m from `free_inertia`

    D is the critical damping of the inertia I on the spring K, as far as `ImplicitImpedance` follows a step of the
    torque within 1 % in 5 steps.

    Args:
        kinematics: Model of the robot.
        dofs: The joints' DoFs in the model.
        posture: Positions of all DoFs for which the gains are made, shape (kinematics.size,) [rad, m]; None: those of
            `neutral_posture`.

    Returns:
        Stiffness [Nm/rad, N/m] and damping [Nms/rad, Ns/m], shape (len(dofs),) each.
    """
    effort_deflection = 0.05  # [rad, m] at which the spring reaches the whole effort
    weight_deflection = 0.01  # [rad, m] at which it carries the weight on the joint
    friction_deflection = 0.02  # [rad, m] at which it overcomes the friction of the joint
    top_frequency = 100.0  # largest natural frequency [rad/s]: 63 steps of 1 ms in a period
    # Largest natural frequency while no other joint holds [rad/s]: the law predicts the spring's deflection at the end
    # of a step from the speed at its beginning, and needs K DRIVE_PERIOD^2 well below m.
    free_top_frequency = 500.0
    largest_loss = 0.5  # largest ratio of its speed that a free joint loses by damping in a step, DRIVE_PERIOD D / m
    posture = neutral_posture(kinematics) if posture is None else posture
    inertia = moved_inertia(kinematics, dofs, posture)
    weight = np.abs(kinematics.bias(posture, np.zeros(kinematics.size))[dofs])
    stiffness = np.maximum(kinematics.effort_limit[dofs] / effort_deflection, weight / weight_deflection)
    free = free_inertia(kinematics, posture)[dofs]
    joints = [kinematics.description.joints[kinematics.dofs[dof]] for dof in dofs]
    friction = np.array([joint.friction for joint in joints])
    stiffness = np.maximum(np.minimum(stiffness, inertia * top_frequency**2), friction / friction_deflection)
    stiffness = np.minimum(stiffness, free * free_top_frequency**2)
    return stiffness, np.minimum(2.0 * np.sqrt(stiffness * inertia), largest_loss * free / DRIVE_PERIOD)


def free_inertia(kinematics: Kinematics, posture: np.ndarray) -> np.ndarray:
    """Compute the inertia that a torque on one DoF moves while all others are free, 1 / (M^-1)_jj, shape (size,)."""
    inertia = kinematics.inertia(posture)
    little = REGULARISATION * inertia.diagonal().max()  # links without mass are refused later, by name
    return 1.0 / np.linalg.inv(inertia + little * np.eye(kinematics.size)).diagonal()


def moved_inertia(kinematics: Kinematics, dofs: np.ndarray, posture: np.ndarray) -> np.ndarray:
    """Compute the inertia that each joint moves about its axis, all others held [kg m^2, kg], shape (len(dofs),).

    On a fixed base these are the links that the joint carries, M_jj. A joint of a floating robot may stand on the links
    that it carries, and then moves the rest of the robot: the larger inertia counts.

    Args:
        kinematics: Model of the robot.
        dofs: The joints' DoFs in the model.
        posture: Positions of all DoFs, shape (kinematics.size,) [rad, m].
    """
    kinematics.update(posture)
    inertia = kinematics.inertia(posture)
    carried = inertia.diagonal()[dofs]
    if kinematics.base is None:
        return carried
    whole = np.array([_inertia_of_the_whole(kinematics, inertia, dof) for dof in dofs])
    return np.maximum(carried, whole - carried)


def _inertia_of_the_whole(kinematics: Kinematics, inertia: np.ndarray, dof: int) -> float:
    """Compute the inertia of the whole robot, as one rigid body, about the axis of a joint [kg m^2, kg]."""
    link = kinematics.description.joints[kinematics.dofs[dof]].child
    twist = kinematics.jacobian(link)[:, dof]
    twist[:3] += np.cross(twist[3:], kinematics.position(kinematics.base_link) - kinematics.position(link))
    rates = np.linalg.solve(kinematics.jacobian(kinematics.base_link)[:, :6], twist)
    return float(rates @ inertia[:6, :6] @ rates)
