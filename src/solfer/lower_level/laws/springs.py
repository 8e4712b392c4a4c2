"""Springs between the motors and the joints of a robot, and which of them a time step resolves."""

from dataclasses import dataclass

import numpy as np

from solfer.model.actuators import Actuators
from solfer.model.kinematics import Kinematics
from solfer.model.neutral_posture import neutral_posture

REGULARISATION = 1e-9
"""Ratio of the largest diagonal entry of M that is added to all, so that M is positive definite where the base's chart
is singular."""


@dataclass(frozen=True)
class Springs:
    """Springs and motors of all DoFs of a model, as seen at the joints; shape (size,) each.

    Attributes:
        stiffness: [Nm/rad], zero without a spring.
        damping: Of the spring [Nms/rad].
        rotor: Inertia of the rotor [kg m^2].
        friction: Damping of the motor [Nms/rad].
        two_mass: Which DoFs have two masses. Other springs only yield, with the torque of the step.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    rotor: np.ndarray
    friction: np.ndarray
    two_mass: np.ndarray

    @property
    def compliance(self) -> np.ndarray:
        """What the springs yield that only yield [rad/Nm], zero for all others, shape (size,)."""
        static = (self.stiffness > 0.0) & ~self.two_mass
        return np.divide(1.0, self.stiffness, out=np.zeros_like(self.stiffness), where=static)


def springs_of(
    kinematics: Kinematics, actuators: Actuators | None, posture: np.ndarray | None, dt: float
) -> Springs | None:
    """Return the springs of a robot; None: no joint has one.

    Args:
        kinematics: Model of the robot's links.
        actuators: Its actuators; `dofs` are all or some DoFs of the model.
        posture: Where it is decided which joints have two masses, shape (size,); None: `neutral_posture`.
        dt: Duration of a step [s].
    """
    if actuators is None or not actuators.stiffness.any():
        return None
    dofs = [kinematics.dofs.index(name) for name in actuators.dofs]
    inertia = kinematics.inertia(neutral_posture(kinematics) if posture is None else posture)
    values = np.zeros((4, kinematics.size))
    values[:, dofs] = actuators.stiffness, actuators.damping, actuators.motor_inertia, actuators.motor_damping
    stiffness, damping, rotor, friction = values
    return Springs(stiffness, damping, rotor, friction=friction, two_mass=resolved(inertia, stiffness, rotor, dt=dt))


def mobility_of(inertia: np.ndarray, rotor: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Compute what accelerates the deflections of chosen springs, 1 / B + M^-1, all joints being free.

    Args:
        inertia: Inertia M of the links, shape (size, size).
        rotor: Inertia B of the rotors, shape (size,).
        chosen: Which springs, shape (size,), n of them.

    Returns:
        Shape (n, n) [1/(kg m^2)].
    """
    little = REGULARISATION * inertia.diagonal().max()
    mobility = np.linalg.inv(inertia + little * np.eye(len(inertia)))[np.ix_(chosen, chosen)]
    return mobility + np.diag(1.0 / rotor[chosen])


def resolved(inertia: np.ndarray, stiffness: np.ndarray, rotor: np.ndarray, dt: float) -> np.ndarray:
    """Find the springs whose free oscillations w a step resolves, (w dt)^2 = dt^2 K (1 / B + M^-1).

    Alone (w dt)^2 of each is at most 0.6: the damping of its free oscillation is then right within 5 %. The fastest
    oscillation of all of them together has at most 2.0, since beyond 2.4 they may diverge; if not, the fastest spring
    is left out.

    Args:
        inertia: Inertia M of the links, shape (size, size).
        stiffness: Stiffness K, zero without a spring, shape (size,).
        rotor: Inertia B of the rotors, shape (size,).
        dt: Duration of a step [s].

    Returns:
        Shape (size,).
    """
    chosen = (stiffness > 0.0) & (rotor > 0.0)
    root = dt * np.sqrt(stiffness[chosen])
    modes = root[:, None] * mobility_of(inertia, rotor, chosen) * root
    alone = modes.diagonal()
    kept = alone <= 0.6
    while kept.any() and np.linalg.eigvalsh(modes[np.ix_(kept, kept)])[-1] > 2.0:
        kept &= alone < alone[kept].max()
    chosen[chosen] = kept
    return chosen
