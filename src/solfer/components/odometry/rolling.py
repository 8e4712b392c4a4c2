"""Where the base is, from wheels that roll and may slip or be lifted, and from a gyroscope."""

import math

import numpy as np

from solfer.components.odometry import motion_kernel
from solfer.components.odometry.consensus import Consensus
from solfer.components.odometry.heading_rate import HeadingRate
from solfer.components.odometry.measured_base import MeasuredBase, about_vertical
from solfer.components.odometry.tags import OdometryTags
from solfer.components.odometry.wheels import Wheels
from solfer.numerics.filters import LowPass
from solfer.points.contact.support_vertex import UP

SHARE_OF_WAY = 0.02
"""Deviation of a wheel's way as a share of it: slip, and radii that are not known better."""

STILL = 1e-7
"""Deviation of a wheel's way in a cycle in which it does not turn [m]."""

FORGET = 2.0
"""Time in which a wheel's rise above the others is forgotten while it touches [s]."""

AT_REST = 0.1
"""Time for which wheels and joints have to stand still before the gyroscope's bias is learned [s]."""


SWAYING = 0.05
"""Share of the speed of a robot that rests which its joints may have on average: one that has stopped still sways."""


class RollingOdometry:
    """The base's pose by the ways of the wheels between two cycles, weighted, and by the IMU.

    With the Jacobian J of the wheel's material at the contact i, the steps dq of the joints and the turn p of the base
    between two cycles, a wheel that rolls tells the base's way m_i = -(J_i dq + p x r_i), J and the arm r taken as the
    mean of both cycles, which leaves an error of third order in the period. Encoders count here, not velocities, so
    that no noise adds up. Tilt and its changes are those of the IMU; the turn about the vertical is fused from wheels
    and gyroscope (`HeadingRate`), the way from all wheels that agree (`Consensus`).

    Ground that rises less than `level` counts as level: the height settles there at that of the contacts. On other
    ground its normal is that of the plane through the contacts, and the height follows the wheels' way.

    Args:
        wheels: The wheels.
        base: What the IMU tells.
        tags: Tags of the configuration.

    Attributes:
        position: Position of the base's origin in the world, shape (3,) [m]; live.
        heading: Angle about the vertical from the world to the base's x axis [rad].
        velocity: Velocity of the base's origin, axes of `Wheels`, shape (3,) [m/s]; live.
        angular: Angular velocity of the base, without the gyroscope's bias, the same axes, shape (3,) [rad/s]; live.
        lifted: Which wheels are lifted, shape (k,).
        rate: Fuses turns.
        consensus: Tells which wheels are believed.
        filter: Filter of the angular velocity that the IMU tells, three numbers, or None.
        smoothing: Filter of the velocity and of the turn's rate, four numbers, or None.
    """

    def __init__(self, wheels: Wheels, base: MeasuredBase, tags: OdometryTags):
        count = len(wheels)
        self._wheels, self._base, self._tags, self._level = wheels, base, tags, math.tan(math.radians(tags.level))
        self.rate = HeadingRate(tags.gyro_noise, tags.gyro_bias, tags.gyro_walk)
        self.consensus = Consensus(count)
        self.filter: LowPass | None = None
        self.smoothing: LowPass | None = None
        self._moving, self._slope = np.zeros(4), np.zeros(2)
        self.position, self.velocity, self.angular = np.zeros((3, 3))
        self.heading = self._offset = self._ground = self._pending = self._rest = self._time = 0.0
        self.lifted, self._rise = np.zeros(count, dtype=bool), np.zeros(count)
        self._weights = np.ones(count)
        self._told, self._slow, self._speeds, self._arms, self._arms_before = np.zeros((5, count, 3))
        self._jacobian = np.zeros_like(wheels.jacobian)
        self._step, self._before, self._sway = np.zeros((3, wheels.joints))

    def start(self) -> None:
        """Begin above the origin, with the heading of the IMU, on level ground."""
        self._base.start()
        self._wheels.set_normal(*UP)
        self._wheels.update(self._base.heading)
        self.rate.reset()
        for low_pass in (self.filter, self.smoothing):
            if low_pass is not None:
                low_pass.reset()
        self.heading = self._base.heading
        self._offset = self._ground = self._pending = self._rest = self._time = 0.0
        self.lifted[:], self._rise[:], self._slow[:], self.consensus.believed[:] = False, 0.0, 0.0, True
        self._sway[:] = 0.0
        self._weigh()
        self.position[:] = 0.0, 0.0, -self._mean_height()
        self._remember()
        self._move()

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the base somewhere else on the ground [m], with another heading [rad]."""
        self.position[:2] = x, y
        self._offset += heading - self.heading
        self.heading = heading
        self.rate.heading_variance = 0.0

    def update(self, period: float) -> None:
        """Follow what has been measured within a cycle of `period` [s]."""
        self._base.read()
        self._wheels.update(self._base.heading)
        np.subtract(self._wheels.position, self._before, out=self._step)
        self._right(period)
        self._weigh()
        self._tell()
        motion, turn = self._fuse(period)
        self._advance(motion, turn, period)
        self._note_rises(period)
        self._find_ground()
        self._remember()
        self._move()

    def _right(self, period: float) -> None:
        """Right the tilt of what has been measured in a cycle of `period` [s]; here it is taken as it is."""

    def _fuse(self, period: float) -> tuple[np.ndarray, float]:
        """Return the base's way, shape (3,) [m], and its turn about the vertical [rad] in this cycle."""
        turn = self._turn(period)
        self._doubt(turn, period)
        return self.consensus.mean(self._told, self._arms, turn, self._weights), turn

    def _doubt(self, turn: float, period: float) -> None:
        """Find out which wheels slip, by their ways of the last moments: encoders are too coarse for one cycle."""
        tags, share = self._tags, period / (self._tags.slip_time + period)
        self._slow *= 1.0 - share
        np.multiply(self._told, share, out=self._speeds)
        self._slow += self._speeds
        tolerance = tags.slip * period + tags.slip_share * math.hypot(*self.consensus.motion.tolist())
        self.consensus.agree(self._slow, self._arms, turn, self._weights, tolerance)

    def _weigh(self) -> None:
        """Weigh the wheels: those that are lifted do not count, unless fewer than two would be left."""
        if self._tags.forces:
            np.copyto(self._weights, self._wheels.forces)
            self._weights *= self._weights > self._tags.touch
        else:
            np.logical_not(self.lifted, out=self._weights)
        if np.count_nonzero(self._weights) < 2:
            self._weights[:] = 1.0

    def _trusted(self) -> np.ndarray:
        """Weigh the wheels that are believed; those that touch now may be others, which then all count."""
        weights = self._weights * self.consensus.believed
        return weights if np.count_nonzero(weights) > 1 else self._weights

    def _tell(self) -> None:
        """Compute the way that each wheel tells, and its arm, without a turn about the vertical."""
        wheels = self._wheels
        motion_kernel.tell(
            wheels.jacobian,
            self._jacobian,
            wheels.arms,
            self._arms_before,
            self._step,
            self._base.turned,
            self._told,
            self._arms,
        )

    def _turn(self, period: float) -> float:
        """Return the turn about the vertical in this cycle, and learn the gyroscope's bias at rest."""
        weights = self._trusted()
        wheels, spread = self.consensus.turn(self._told, self._arms, weights)
        deviation = SHARE_OF_WAY * float(np.abs(self._told).max()) + STILL
        variance = deviation**2 * float(weights.max()) / max(spread, 1e-9 * float(weights.max()))
        told, time = self._listen(period)
        if self._rest > AT_REST:
            turn = 0.0
            if time:
                self.rate.learn(told, time)
        else:
            turn = self.rate.turn(told - self._pending, time, wheels, variance)
        self._note_turn(turn, told)
        return turn

    def _listen(self, period: float) -> tuple[float, float]:
        """Return what the gyroscope tells of the turn [rad], and for which time [s]; zeros where nothing is new."""
        self._time += period
        time = self._time if self._base.fresh else 0.0
        told = float(self._base.turned[2])
        self._note_rest(told, time, period)
        return told, time

    def _note_turn(self, turn: float, told: float) -> None:
        """Note a turn, and how far it is from what the gyroscope tells of the same time [rad]."""
        self._pending += turn
        if self._base.fresh:
            self._offset += self._pending - told
            self._pending = self._time = 0.0

    def _note_rest(self, told: float, time: float, period: float) -> None:
        """Note for how long no joint has moved and the gyroscope tells no more than its bias and its noise."""
        keep = AT_REST / (AT_REST + period)
        self._sway *= keep
        self._sway += (1.0 - keep) * self._step
        limit = self._tags.rest * period
        still = float(np.abs(self._step).max()) <= limit and float(np.abs(self._sway).max()) <= SWAYING * limit
        if time:
            still = still and self.rate.explains(told, time)
        self._rest = self._rest + period if still else 0.0

    def _advance(self, motion: np.ndarray, turn: float, period: float) -> None:
        """Move the base, in the middle of the turn."""
        self.position += about_vertical(motion, self.heading + 0.5 * turn)
        self.heading = self._base.heading + self._offset if self._base.fresh else self.heading + turn
        if self._wheels.is_level:
            wanted = self._ground - self._mean_height()
            self.position[2] += period / (self._tags.settle + period) * (wanted - self.position[2])

    def _mean_height(self) -> float:
        """Return the height of the contacts above the base's origin, mean of the wheels that touch [m]."""
        return float(self._weights @ self._wheels.arms[:, 2]) / float(self._weights.sum())

    def _note_rises(self, period: float) -> None:
        """Note how far wheels have risen against the others, and which are lifted."""
        motion_kernel.rises(
            self.consensus.rest,
            self._arms,
            self._base.turned,
            self._weights,
            self._trusted(),
            self._wheels.normal,
            self._tags.clearance,
            1.0 - period / FORGET,
            self._slope,
            self._rise,
            self.lifted,
        )

    def _find_ground(self) -> bool:
        """Find the normal of the ground, and return whether there is one to be found.

        Where it becomes level again, its height is that of the contacts.
        """
        if not (self._level and motion_kernel.plane(self._weights, self._wheels.arms, self._slope)):
            return False
        was_level, (a, b) = self._wheels.is_level, self._slope.tolist()
        slope = math.hypot(a, b)
        if slope > self._level * (1.0 if was_level else 0.7):
            self._wheels.set_normal(-a, -b, 1.0)
        elif not was_level:
            self._ground = float(self.position[2]) + self._mean_height()
            self._wheels.set_normal(*UP)
        return True

    def _remember(self) -> None:
        self._before[:] = self._wheels.position
        self._jacobian[:] = self._wheels.jacobian
        self._arms_before[:] = self._wheels.arms

    def _move(self) -> None:
        """Compute the velocities of this moment."""
        wheels, weights = self._wheels, self._trusted()
        self.angular[:] = self._base.angular
        self.angular[2] -= self.rate.bias
        if self.filter is not None:
            self.filter.step(self.angular)
        motion_kernel.move(wheels.jacobian, wheels.velocity, self.angular, wheels.arms, weights, self.velocity)
        if self.smoothing is not None:
            self._moving[:3], self._moving[3] = self.velocity, self.angular[2]
            self.smoothing.step(self._moving)
            self.velocity[:], self.angular[2] = self._moving[:3], self._moving[3]
