"""How wheels and base move between two measurements of the joints."""

from functools import partial

import numpy as np

from solfer.components.odometry import filter_kernel
from solfer.components.odometry.feet import Feet
from solfer.components.odometry.wheels import Wheels
from solfer.numerics.blocks import MemoryBlock


class WheelMotion:
    """What the steps of the joints measure of the base; vectors are in the heading frame.

    Args:
        wheels: The wheels k.

    Attributes:
        wheels: See above.
        step: Step of each joint, shape (n,) [rad].
        displacements: Displacement of the base by each wheel, without a yaw, shape (k, 3) [m].
        speeds: These by time, shape (k, 3) [m/s].
        arms: From the base's origin to the contacts, mean of both measurements, shape (k, 3) [m].
        arm: Mean of these, shape (3,) [m].
        tilting: Displacement of the mean of the contacts by the base's tilting, shape (3,) [m].
        weights: Weight of each wheel if it touches, shape (k,).
        trusted: The same if it also rolls, shape (k,).
        spreads: Spread of each wheel's innovations, shape (k,).
        variances: Variance of each wheel's speed, shape (k,) [m^2/s^2].
        feet: Which of them stand, if they are feet; None: they are wheels.
        block: What compiled functions get of these.
        find_step: find_step(sway, keep) computes the steps of the joints since the last `remember`, and smooths them as
            `sway`, which keeps a ratio of what it was; returns the largest step of all, of those of legs, and the
            largest sway [rad].
    """

    def __init__(self, wheels: Wheels):
        count = len(wheels)
        self.wheels = wheels
        self.weights, self.trusted, self.spreads, self.variances = np.zeros((4, count))
        self.displacements, self.speeds, self.arms, arms_before = np.zeros((4, count, 3))
        jacobian_before = np.zeros_like(wheels.jacobian)
        self.step, joints_before = np.zeros((2, wheels.joints))
        self._before = joints_before, jacobian_before, arms_before
        self.arm, self.tilting = np.zeros((2, 3))
        self.block = MemoryBlock(
            filter_kernel.MOTION,
            count=count,
            joint_count=wheels.joints,
            steps=wheels.steps,
            jacobian=wheels.jacobian,
            jacobian_before=jacobian_before,
            arms=wheels.arms,
            arms_before=arms_before,
            step=self.step,
            torques=wheels.torque,
            legs=wheels.legs,
            weights=self.weights,
            trusted=self.trusted,
            spreads=self.spreads,
            displacements=self.displacements,
            mean_arms=self.arms,
            arm=self.arm,
            tilting=self.tilting,
            speeds=self.speeds,
        )
        self.feet = Feet(count, self.block, wheels.weight) if wheels.steps else None
        self.find_step = partial(filter_kernel.joint_motion, wheels.position, joints_before, self.step, wheels.legs)

    def weigh(self, lifted: np.ndarray, touch: float | None) -> None:
        """Weigh the wheels: those that are lifted do not count, unless fewer than two would be left.

        Args:
            lifted: Which wheels are lifted by how they move, shape (k,).
            touch: Force from which a wheel touches [N]; then its force is its weight. None: `lifted` counts.
        """
        if touch is None:
            np.logical_not(lifted, out=self.weights)
        else:
            np.copyto(self.weights, self.wheels.forces)
            self.weights *= self.weights > touch
        if np.count_nonzero(self.weights) < 2:
            self.weights[:] = 1.0

    def mean_height(self) -> float:
        """Return the height of the contacts above the base's origin, mean of the wheels that touch [m].

        Where all feet are in the air it is that of the lowest one.
        """
        if not self.weights.any():
            return float(self.wheels.arms[:, 2].min())
        return float(self.weights @ self.wheels.arms[:, 2]) / float(self.weights.sum())

    def remember(self) -> None:
        """Let the next step begin here."""
        joints, jacobian, arms = self._before
        joints[:] = self.wheels.position
        jacobian[:] = self.wheels.jacobian
        arms[:] = self.wheels.arms
