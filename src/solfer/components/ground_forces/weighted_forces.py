"""Forces at contacts that explain what the world does to a robot best."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.components.ground_forces import kernel
from solfer.dynamics import BIAS, INERTIA
from solfer.numerics.blocks import MemoryBlock
from solfer.points.contact.contacts import Contact
from solfer.robot import Robot

PRIOR_INFORMATION = 1e-10
"""What is known of a force before anything is measured, as the inverse of its variance [1/N^2]."""


def weighed(contacts: Sequence[Contact], weights: np.ndarray) -> np.ndarray:
    """Return the DoFs that contacts move and that weigh, in their order, shape (m,)."""
    moved = [contact.columns for contact in contacts]
    return np.flatnonzero(np.isin(np.arange(len(weights)), np.concatenate(moved)) & (weights > 0.0))


class WeightedForces:
    """Forces of the ground at contacts, by least squares, of what the world adds to the torques of the joints.

    With the dynamics M a + h = t + w, where t are the torques and w is what the world does along the DoFs,
    w = M a + h - t. Without a cut-off the robot counts as not accelerated: w = h - t. With one, w is the output of a
    low-pass filter of first order, whose input has M (v - v') / T in place of M a, with the velocities v and v' of this
    and of the last cycle of the time T. No acceleration is measured or differentiated: the filter's step response is
    that of the generalised momentum. Source: A. De Luca, R. Mattone, "Sensorless robot collision detection and hybrid
    force/motion control", Proc. IEEE ICRA, 2005.

    With the Jacobian J of the contacts the forces f minimise sum_i ((w - J^T f)_i / s_i)^2. The deviations s_i of
    joints are those of their torque sensors; those of the base are what may push it besides the ground, since nothing
    drives it. Where several forces do it, it is the smallest. The contacts count whether they are lifted or not: a
    lifted one gets a force of about zero.

    Args:
        robot: The Robot.
        contacts: The contacts, k of them.
        deviations: s, shape (n,) [N, Nm].
        cut_off: Cut-off frequency [Hz], or None.
        jacobian: J, shape (3k, n); live.
        torque: Torques of the joints, shape (n,) [Nm, N]; live.
        offsets: What is added to w for the forces, shape (n,) [Nm, N]; live.

    Attributes:
        world: w, shape (n,) [N, Nm]; live.
        value: The forces, shape (k, 3), world axes [N]; live.
        push: What is left of w at a floating base: force, then torque about its origin, world axes, shape (6,) [N, Nm];
            live.
    """

    def __init__(
        self,
        robot: Robot,
        contacts: Sequence[Contact],
        deviations: np.ndarray,
        cut_off: float | None,
        *,
        jacobian: np.ndarray,
        torque: np.ndarray,
        offsets: np.ndarray,
    ):
        self._cut_off = cut_off
        dynamics = robot.dynamics
        elements = [BIAS] if cut_off is None else [BIAS, INERTIA]
        dynamics.subscribe(elements)
        self._use = dynamics.manager.use
        rows, size = jacobian.shape
        self._bias = dynamics.bias
        self._torque = torque
        self._velocity = robot.state.velocity
        self.world, self._before = np.zeros((2, size))
        self.value = np.zeros((len(contacts), 3))
        self.push = np.zeros(6)
        weights = deviations**-2
        columns = weighed(contacts, weights)
        base = robot.kinematics.base
        self._block = MemoryBlock(
            kernel.EXPLANATION,
            row_count=rows,
            dofs=size,
            bias=self._bias,
            torque=torque,
            observes=cut_off is not None,
            inertia=None if cut_off is None else dynamics.inertia,
            velocity=self._velocity,
            before=self._before,
            world=self.world,
            offsets=offsets,
            corrected=np.zeros(size),
            jacobian=jacobian,
            weights=weights,
            column_count=len(columns),
            columns=columns,
            diagonal=PRIOR_INFORMATION,
            factor=np.zeros((rows, rows)),
            forces=self.value.reshape(-1),
            rest=np.zeros(size),
            is_floating=base is not None,
            position=robot.state.position,
            rotation=None if base is None else base.rotation,
            push=self.push,
        )

    def start(self) -> None:
        """Begin, not accelerated, with the torques of now."""
        self._use(BIAS)
        self._before[:] = self._velocity
        np.subtract(self._bias, self._torque, out=self.world)

    def update(self, period: float) -> None:
        """Compute what the world does after `period` [s] more, the forces, and the push on the base."""
        self._use(BIAS)
        ratio = 1.0
        if self._cut_off is not None:
            self._use(INERTIA)
            ratio = -math.expm1(-2.0 * math.pi * self._cut_off * period)
        kernel.explain(self._block.address, period, ratio)
