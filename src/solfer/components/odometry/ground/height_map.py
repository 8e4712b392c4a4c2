"""A map of the ground's height along the tracks of the wheels."""

import math

import numpy as np

from solfer.components.odometry.ground import height_kernel as kernel
from solfer.numerics.blocks import MemoryBlock


class HeightMap:
    """Heights of the ground where wheels have rolled, and of the floor on which they are.

    A wheel that rolls where another one has been knows its height, and so that of the base: the wheels that lead find
    an edge between two slopes, and those behind carry the base over it. On a floor all wheels are equally high. A wheel
    that leads may be where the floor ends: the more it does the less it counts, and not at all where it is further than
    8 mm from the floor. Elsewhere a wheel that has come to rest stays as high as it is: so a base on a step keeps its
    height while a wheel is lifted.

    Args:
        radii: Radii of the wheels, shape (k,) [m].

    Attributes:
        level: Whether all wheels that touch are on one floor.
    """

    def __init__(self, radii: np.ndarray):
        count = len(radii)
        samples = 256  # of a track: 5 m; older ones are dropped
        self._cycle = np.zeros(1, dtype=np.int64)
        self._risen = np.zeros((count, samples))
        self._heads = np.zeros(count, dtype=np.int64)
        self._followed = np.zeros((count, 2), dtype=np.int64)
        self._leading = np.zeros(count)
        self._stood = np.full((count, 4), math.nan)
        self._floor = np.array((math.nan, 0.0))
        self._block = MemoryBlock(
            kernel.HEIGHTS,
            count=count,
            sample_count=samples,
            cycle=self._cycle,
            radii=radii,
            floor=self._floor,
            tracks=np.zeros((count, samples, 3)),
            risen=self._risen,
            heads=self._heads,
            followed=self._followed,
            leading=self._leading,
            places=np.zeros((count, 3)),
            stood=self._stood,
        )
        self.level = False

    @property
    def floor(self) -> float:
        """Height of the floor [m]; NaN where there is none."""
        return float(self._floor[0])

    def start(self, floor: float) -> None:
        """Begin without tracks, on a floor of a height [m]; NaN: there is none."""
        self.forget()
        self._floor[:] = floor, 0.0
        self._leading[:] = 0.0
        self._stood[:] = math.nan
        self._cycle[:] = 0
        self.level = not math.isnan(floor)

    def forget(self) -> None:
        """Drop all tracks, but not the floor."""
        self._heads[:] = 0
        self._followed[:] = -1
        self._risen[:] = 0.0

    def missing_height(
        self,
        arms: np.ndarray,
        normal: np.ndarray,
        position: np.ndarray,
        heading: float,
        weights: np.ndarray,
        *,
        velocity: np.ndarray,
        yaw_rate: float,
    ) -> float:
        """Return how far the base is below the height that the map has for it [m]; NaN where it has none.

        Args:
            arms: From the base's origin to the contacts in the heading frame, shape (k, 3) [m].
            normal: Normal of the ground in that frame, shape (3,).
            position: Position of the base's origin in the world, shape (3,) [m].
            heading: Heading [rad].
            weights: Weights of the wheels, shape (k,); those of zero are left out.
            velocity: Velocity of the base in the heading frame, shape (3,) [m/s].
            yaw_rate: Yaw rate [rad/s].
        """
        address = self._block.address
        return float(kernel.missing_height(address, arms, normal, position, heading, weights, velocity, yaw_rate))

    def note(self, raised: float, weights: np.ndarray) -> None:
        """Note where wheels are after the base has been raised [m]; weights are those of `missing_height`."""
        self.level = bool(kernel.note(self._block.address, raised, weights))
