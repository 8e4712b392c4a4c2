"""A model of the masses that corrects itself by the forces of the ground."""

import math

import numpy as np

from solfer.components.diagnostics import Entry, Status
from solfer.components.inverse_dynamics.correction_kernel import (
    CORRECTION,
    ESTIMATES,
    LARGEST,
    LARGEST_SHARE,
    correct,
    reset,
)
from solfer.components.inverse_dynamics.ground import Ground
from solfer.errors import ComponentError, ModelError
from solfer.numerics.blocks import MemoryBlock
from solfer.robot import Robot

CONSTANT = 0.001
"""What averages leave of the error of the centre of mass, of one sign for long: places of contacts, postures [m]."""


class ModelCorrection:
    """Estimates how far the model's centre of mass and its mass are off, and lets the model follow, slowly.

    The forces f_i of the ground at p_i, with moments t_i, change the angular momentum L about the true centre of mass
    c. About the model's centre c_m, with c = c_m + R e and the orientation R of the base,

        sum (p_i - c_m) x f_i + t_i = (R e) x F + dL/dt,   F = sum f_i

    With dL/dt as noise, the two horizontal rows of this measure the constant e [m] linearly. It is the zero moment
    point with the acceleration that F itself measures, F_xy / m. What of e is vertical cannot be seen: e_z is found
    only where the base has been tilted in different ways. F_z / (m g) - 1 measures the error of the mass as a share of
    it, with the vertical acceleration as noise. Source: S. Kajita et al., "Introduction to Humanoid Robotics", 2014,
    section 3.2. A wrong tilt of the base turns both sides alike, and does not count.

    The model follows in one place, its arrays of masses, which the dynamics and all centres of mass share: masses and
    inertias of all bodies get one factor, and the centre of mass of the base's body is moved by e m / m_base.

    Forces have to be measured at all contacts that carry the robot. Sensors there see all of the error. Forces that are
    estimated from torques of the legs contain the weights of the legs as the model has them: what of e and of the mass
    lies in the legs is not seen, and their weights at wrong places bias the rest. `deviation` does not know of that.
    Forces that are estimated with the equations of the base contain the whole mass of the model, and show none of its
    error.

    Args:
        robot: The Robot; others that share what it measures see the correction.
        twin: Its twin, whose model follows as well.
        ground: Its contacts.

    Attributes:
        offset: e in axes of the base, then the share, shape (4,) [m, m, m, -]; live.
        applied: How much of that the model has, shape (4,); live.
        covariance: That of e, shape (3, 3) [m^2]; live.

    Raises:
        ComponentError: The robot has no floating base, or there is no gravity.
        ModelError: The link of the base has no mass.
    """

    REASONS = {
        0: "estimates",
        1: "forces are not measured",
        2: "a force is not finite",
        3: "forces do not change any more",
        4: "contacts come or go",
        5: "the robot is pushed or accelerates",
        6: "forces contradict the estimate",
    }
    """What the kernel returns, in words."""

    def __init__(self, robot: Robot, twin: Robot, ground: Ground):
        tree = robot.kinematics.tree
        if robot.kinematics.base is None or not robot.gravity.any():
            raise ComponentError(
                f"the model of '{robot.name}' is not corrected", expected="a floating base that gravity pulls"
            )
        base = robot.kinematics.attachment(robot.kinematics.base_link).joint
        if not tree.masses[base] > 0.0:
            raise ModelError(
                f"link '{robot.kinematics.base_link}' has no mass, and its centre is to be corrected",
                where=robot.description.where,
                expected="a base with `<inertial>`",
            )
        self._robot = robot
        self._twin = twin.kinematics.tree.inertial
        self._ground = ground
        self._base = base
        # the twin has the model of the file, also where another component has corrected the Robot's
        self._original = self._twin.copy()
        self.offset, self.applied = np.zeros((2, 4))
        self.covariance = np.zeros((3, 3))
        self._share_variance = np.zeros(1)
        self._found = ESTIMATES

    def connect(self) -> None:
        """Bind what it reads and writes; the Robot's contacts are then complete."""
        robot = self._robot
        tree = robot.kinematics.tree
        contacts = robot.contacts
        self._block = MemoryBlock(
            CORRECTION,
            contact_count=len(contacts.wrenches),
            positions=contacts.positions,
            wrenches=contacts.wrenches,
            before=np.zeros_like(contacts.wrenches),
            tracked_count=len(self._ground.fractions),
            fractions=self._ground.fractions,
            bodies=len(tree.masses),
            base=self._base,
            gravity=float(np.linalg.norm(robot.gravity)),
            placements=tree.placements,
            original=self._original,
            used=tree.inertial,
            twin=self._twin,
            offset=self.offset,
            covariance=self.covariance,
            share_variance=self._share_variance,
            applied=self.applied,
            smooth=np.zeros(6),
            times=np.zeros(4),
            row=np.zeros(3),
            gain=np.zeros(3),
        )

    @property
    def reason(self) -> str:
        """What it does, or why it does not estimate."""
        return self.REASONS[self._found]

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations of e and of the share, shape (4,) [m, m, m, -]; a new array."""
        variance = np.diag(self.covariance) + CONSTANT**2
        return np.sqrt(np.append(variance, self._share_variance))

    def start(self) -> None:
        """Begin with the model of the file."""
        reset(self._block.address)
        self._found = ESTIMATES

    def update(self, step: float) -> None:
        """Estimate, and correct the model, a time [s] after the last call."""
        # its access brings the places of contacts up to date
        _ = self._robot.contacts
        self._found = correct(self._block.address, step)

    def report(self, component: str) -> Status:
        """Return the estimates for `/diagnostics`: a warning where forces cannot be used, or one is at its bound."""
        offset = self.offset
        deviation = self.deviation
        is_bounded = bool((np.abs(offset[:3]) >= LARGEST).any() or abs(offset[3]) >= LARGEST_SHARE)
        summary = "an error is as large as it may be" if is_bounded else self.reason
        entries = [
            Entry(f"centre of mass, {axis}", f"{1e3 * offset[k]:.1f} mm, deviation {1e3 * deviation[k]:.1f} mm")
            for k, axis in enumerate("xyz")
        ]
        entries.append(Entry("mass", f"{1e2 * offset[3]:.1f} %, deviation {1e2 * deviation[3]:.1f} %"))
        entries.append(Entry("applied", f"{1e3 * math.hypot(*self.applied[:3]):.1f} mm"))
        level = int(is_bounded or self._found in (1, 2, 3, 6))
        return Status(level, f"{component}: model", summary, hardware_id=component, values=tuple(entries))
