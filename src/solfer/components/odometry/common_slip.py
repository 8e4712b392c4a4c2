"""Slip of all wheels at once, which no wheel contradicts: the accelerometer does."""

import math

import numpy as np

from solfer.components.odometry import common_slip_kernel as kernel
from solfer.components.odometry.wheel_motion import WheelMotion
from solfer.numerics.blocks import MemoryBlock

RELIABILITY = 0.03
"""Standard deviation of a velocity that an accelerometer alone has followed for a second [m/s]: by tilt, mostly."""


class CommonSlip:
    """Finds out whether all wheels slip together, such as against a step, and how fast the base is meanwhile.

    Over some 0.4 s the wheels and the accelerometer gain the same velocity, within 12 mm/s, what the tilt errs by, and
    what the plane through the contacts has turned by lately; a constant difference is learned. Where that is a thousand
    times less likely than slip, wheels slip: the base goes on with the velocity that it had before and what the
    accelerometer has measured since. On average it does not go faster than the wheels, nor elsewhere than they go,
    within 0.05 m/s; where it hardly moves it is taken to rest but for swaying. Slip ends where both velocities are the
    same again, or the wheels rest. Where no slip explains what the accelerometer measures, it is wrong, or wheels
    slide: they count, and are not compared for 2 s.

    Args:
        motion: The wheels.
        slope: Slope of the plane through their contacts, shape (2,); live.

    Attributes:
        speed: Velocity of the base by the wheels in the heading frame, shape (2,) [m/s]; live.
        slip: By how much that is too fast, shape (2,) [m/s]; live.
        lasts: For how long all wheels have slipped [s]; 0: they roll.
        contradicted: Whether the accelerometer measured what no slip explains, in the last 2 s.
    """

    def __init__(self, motion: WheelMotion, slope: np.ndarray):
        self._motion = motion
        self.speed, self.slip, self._before, self._gained, self._bias, self._slipped = np.zeros((6, 2))
        self._usual = np.zeros(2)
        self._probability, self._lasts, self._excess = np.ones((3, 1))
        self.lasts = 0.0
        self._block = MemoryBlock(
            kernel.SLIP,
            speed=self.speed,
            before=self._before,
            gained=self._gained,
            swing=np.zeros(2),
            bias=self._bias,
            slip=self.slip,
            slipped=self._slipped,
            mean=np.zeros(4),
            slope=slope,
            usual=self._usual,
            probability=self._probability,
            excess=self._excess,
            lasts=self._lasts,
        )
        self.start()

    def start(self) -> None:
        """Begin with wheels that roll on level ground, and nothing to compare with."""
        for numbers in (self._gained, self._bias, self.slip, self._slipped, self._usual):
            numbers[:] = 0.0
        self._lasts[:] = math.nan
        self._probability[:] = 1.0
        self.lasts = 0.0
        self.contradicted = False

    @property
    def probability(self) -> float:
        """Probability that they roll."""
        return 0.0 if self.lasts else float(self._probability[0])

    @property
    def gain(self) -> float:
        """What wheels have gained more than the accelerometer has measured [m/s]."""
        return math.hypot(*self._gained.tolist())

    def follow(
        self,
        pushed: np.ndarray,
        place: np.ndarray,
        axes: np.ndarray,
        inliers: np.ndarray,
        *,
        heading: float,
        rotation: tuple[float, float, float, float],
        tilt: tuple[float, float, float],
    ) -> np.ndarray | None:
        """Compare what wheels and the accelerometer have measured since the IMU was measured the last time.

        Args:
            pushed: Change of the IMU's velocity in its own world, shape (3,) [m/s].
            place: From the base's origin to the IMU in the base, shape (3,) [m].
            axes: Rotation from the base to the heading frame, shape (3, 3).
            inliers: Which wheels agree, shape (k,).
            heading: Heading of the base in that world [rad].
            rotation: Angular velocity in the heading frame [rad/s], and that time [s].
            tilt: Error of the tilt about x and y of the heading frame [rad], and its variance [rad^2].

        Returns:
            How far the base is too far where slip begins, in the heading frame, shape (2,) [m]; live. None else.
        """
        found = kernel.follow(
            self._block.address, self._motion.block.address, inliers, pushed, heading, place, axes, rotation,
            tilt,
        )  # fmt: skip
        lasts = float(self._lasts[0])
        self.lasts = lasts if lasts > 0.0 else 0.0
        self.contradicted = lasts < 0.0
        return self._slipped if found == kernel.BEGINS else None

    def velocity_variance(self, time: float) -> float:
        """Return the variance that the velocity gains in a time [s] by the accelerometer alone [m^2/s^2]."""
        return 2.0 * RELIABILITY * RELIABILITY * self.lasts * time
