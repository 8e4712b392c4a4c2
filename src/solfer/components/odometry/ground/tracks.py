"""Where wheels have been, which tells how high the base is when other wheels come there."""

import math

import numpy as np

from solfer.components.odometry.ground import kernel

SAMPLES = 256
"""Samples of a track; older ones are forgotten."""

TOLERANCE = 0.008
"""How far a wheel may be above or below a floor and still be on it [m]: twice what floors are uneven (DIN 18202)."""

FLAT, UNEVEN = 0.2, 0.003
"""Way on ground that is even by so much [m] after which it is a floor."""


class GroundTracks:
    """Heights of the ground where wheels have been, and of the floor on which they are.

    Wheels that follow others roll where those have been: what those found there, seen from the base of that moment,
    tells where the base is now. So an edge between two slopes is found by the wheels that go ahead, and those behind
    carry the base over it. On a floor all wheels are equally high. A wheel that goes ahead may be where the floor ends:
    it counts the less the more it does, and not at all where it is further than `TOLERANCE` from the floor; its
    track then is what was measured, from where the floor has ended.

    Args:
        radii: Radii of the wheels, shape (k,) [m].

    Attributes:
        level: Whether all wheels that touch are on one floor.
    """

    def __init__(self, radii: np.ndarray):
        count = len(radii)
        self._radii, self._cycle = radii, 0
        self._tracks, self._risen = np.zeros((count, SAMPLES, 3)), np.zeros((count, SAMPLES))
        self._heads, self._followed = np.zeros(count, dtype=np.int64), np.zeros((count, 2), dtype=np.int64)
        self._places, self._known, self._outward = np.zeros((count, 3)), np.zeros(count), np.zeros(count)
        self._floor = np.array((math.nan, 0.0))
        self.level = False

    @property
    def floor(self) -> float:
        """Height of the floor [m]; NaN where there is none."""
        return float(self._floor[0])

    def start(self, floor: float) -> None:
        """Forget all tracks.

        Args:
            floor: Height of the floor [m]; NaN: there is none.
        """
        self.forget()
        self._floor[:], self._outward[:], self._cycle = (floor, 0.0), 0.0, 0
        self.level = not math.isnan(floor)

    def forget(self) -> None:
        """Forget where wheels have been, but not the floor."""
        self._heads[:], self._followed[:], self._risen[:] = 0, -1, 0.0

    def anchor(
        self,
        arms: np.ndarray,
        normal: np.ndarray,
        position: np.ndarray,
        heading: float,
        weights: np.ndarray,
        velocity: np.ndarray,
        turn: float,
    ) -> float:
        """Return how far the base is below where wheels know it to be [m]; NaN where none does.

        Args:
            arms: From the base's origin to the contacts, axes of the heading, shape (k, 3) [m].
            normal: Normal of the ground, the same axes, shape (3,).
            position: Of the base's origin in the world, shape (3,) [m].
            heading: Heading [rad].
            weights: Weights of the wheels, shape (k,); those of zero are left out.
            velocity: Of the base, axes of the heading, shape (3,) [m/s].
            turn: Turn about the vertical [rad/s].
        """
        self._cycle += 1
        return float(
            kernel.anchor(
                arms, normal, self._radii, position, heading, weights, velocity, turn, self._cycle, TOLERANCE,
                self._floor, self._tracks, self._heads, self._followed, self._outward, self._places, self._known,
            )
        )  # fmt: skip

    def note(self, raised: float, weights: np.ndarray) -> None:
        """Note where wheels are, after the base has been raised [m]; weights are those of `anchor`."""
        on_floor = kernel.note(
            self._places, raised, weights, TOLERANCE, FLAT, UNEVEN,
            self._floor, self._tracks, self._risen, self._heads,
        )  # fmt: skip
        self.level = on_floor > 0
