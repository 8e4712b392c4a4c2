"""The ground below the wheels: its height, its slope, and the wheels that are lifted from it."""

import math

import numpy as np

from solfer.components.odometry import filter_kernel
from solfer.components.odometry.ground.height_map import HeightMap
from solfer.components.odometry.kalman import WheelInertialFilter
from solfer.components.odometry.wheel_motion import WheelMotion
from solfer.numerics.blocks import MemoryBlock
from solfer.points.contact.support_vertex import UP


class GroundPlane:
    """The ground by the contacts of the wheels.

    Args:
        motion: The wheels.
        kalman: The filter, which it corrects.
        level: Slope up to which ground counts as level.

    Attributes:
        map: Heights of the ground.
        slope: Slope of the plane through the contacts, shape (2,); live.
        rise: Rise of each wheel above the others, shape (k,) [m]; live.
        lifted: Which wheels are lifted, shape (k,); live.
        turns: Whether the plane has turned otherwise than a robot can drive, with all wheels on the ground.
        apart: By how much it has, shape (1,) [rad]; live.
        block: What compiled functions get of these.
    """

    def __init__(self, motion: WheelMotion, kalman: WheelInertialFilter, level: float):
        count = len(motion.weights)
        self._motion = motion
        self._kalman = kalman
        self._level = level
        self.map = HeightMap(np.array(motion.wheels.radii))
        self.slope = np.zeros(2)
        self.rise = np.zeros(count)
        self.lifted = np.zeros(count, dtype=bool)
        self.turns = False
        self.apart, self._since = np.zeros((2, 1))
        self.block = MemoryBlock(
            filter_kernel.GROUND,
            count=count,
            slope=self.slope,
            rise=self.rise,
            lifted=self.lifted,
            rolled=np.zeros(count),
            followed=np.zeros(2),
            apart=self.apart,
            since=self._since,
        )
        self._floor = math.nan
        self._floor_variance = 0.0
        self._samples = 0
        self._elapsed = 0.0

    def start(self) -> None:
        """Begin on level ground, which all wheels touch."""
        self.rise[:] = 0.0
        self.lifted[:] = False
        self.turns = False
        self._since[:] = math.inf  # any slope is explained
        self._samples = 0
        self._elapsed = 0.0

    def start_map(self) -> None:
        """Begin with a floor where the wheels are on level ground, and measure the tilt by it."""
        self.map.start(0.0 if self._motion.wheels.ground.is_level else math.nan)
        self._floor = self.map.floor
        self._floor_variance = 0.0
        self._measure_tilt()

    def settle(self, time: float, period: float) -> None:
        """Measure the height on a floor as well as the floor's height was known first.

        Args:
            time: Time in which that comes into effect [s].
            period: Time since the last measurement [s].
        """
        variance = float(self._kalman.covariance[2, 2])
        if not self.map.level:
            return
        if self.map.floor != self._floor:
            self._floor = self.map.floor
            self._floor_variance = variance
        deviation = 0.005  # [m] of the height of level ground
        if variance > self._floor_variance + deviation * deviation:
            self._kalman.settle_height(deviation * math.sqrt(time / period))

    def update(self, fresh: bool, period: float, heading: float, angular: np.ndarray) -> None:
        """Find the normal of the ground; level ground measures the error of the tilt.

        Args:
            fresh: Whether the IMU has measured the tilt.
            period: Time since the last measurement [s].
            heading: Heading of the base [rad].
            angular: Its angular velocity in the heading frame, shape (3,) [rad/s].
        """
        motion = self._motion
        wheels = motion.wheels
        # feet that lift and land are on no plane until all of them stand
        found = (
            self._level
            and (motion.feet is None or motion.weights.all())
            and filter_kernel.follow_plane(
                motion.block.address, self.block.address, heading, self._kalman.velocity, angular, fresh, period
            )
        )
        self.turns = found == 2 and motion.feet is None
        if found:
            a, b = self.slope.tolist()
            if math.hypot(a, b) > self._level * (1.0 if wheels.ground.is_level else 0.7):
                wheels.set_normal(-a, -b, 1.0)
            elif not wheels.ground.is_level:
                wheels.set_normal(*UP)
        if not fresh:
            return
        self._samples += 1
        self._elapsed += period
        if self._samples >= 10:  # errors of grounds and IMUs last longer
            self._kalman.settle_tilt(self._elapsed)
            self._samples = 0
            self._elapsed = 0.0
            if found:
                self._measure_tilt()

    def _measure_tilt(self) -> None:
        """Measure the tilt by the plane through the contacts, if that can be level."""
        motion = self._motion
        if not (self.map.level and filter_kernel.plane(motion.weights, motion.wheels.arms, self.slope)):
            return
        x, y = self._kalman.tilt.tolist()
        a, b = self.slope.tolist()
        self._kalman.level(x + b, y - a)
