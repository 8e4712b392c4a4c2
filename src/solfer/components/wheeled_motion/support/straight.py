"""What wheels that nothing steers cannot do."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.components.wheeled_motion.references import References

SMALL = 1e-6
"""Velocities that are left out without a word [m/s, rad/s]."""


class StraightAhead:
    """Leaves out of what is wanted all that wheels which nothing steers cannot do: ways across them, and turns.

    Ways along the wheels and heights stay. The wheels are parallel; the direction of the first one counts.

    Args:
        wheels: Names of the wheels.
    """

    def __init__(self, wheels: Sequence[str]):
        self._wheels = ", ".join(f"'{wheel}'" for wheel in wheels)
        self._across, self._base, self._turn = np.zeros(2), np.zeros(3), 0.0
        self._vertices = np.zeros((len(wheels), 3))

    def update(self, references: References, direction: np.ndarray, heading: float) -> str:
        """Change the velocities that are wanted until `restore`; return what is left out, empty if nothing is.

        Args:
            references: What is wanted.
            direction: Direction in which the wheels roll in the world, shape (2,).
            heading: Heading of the base [rad].
        """
        self._base[:], self._vertices[:] = references.velocity, references.vertex_velocity
        self._turn = float(references.turn[2])
        dx, dy = direction.tolist()
        self._across[:] = -dy, dx
        base = self._remove(references.velocity)
        cos, sin = math.cos(heading), math.sin(heading)
        self._across[:] = sin * dx - cos * dy, cos * dx + sin * dy
        footprint = 0.0
        for velocity, is_lifted in zip(references.vertex_velocity, references.lifted.tolist(), strict=True):
            footprint = max(footprint, 0.0 if is_lifted else self._remove(velocity))
        turn, references.turn[2] = abs(self._turn), 0.0
        left = [
            text
            for size, text in (
                (base, f"{base:.3g} m/s sideways"),
                (turn, f"turns of {turn:.3g} rad/s"),
                (footprint, f"footprints that change by {footprint:.3g} m/s to the side"),
            )
            if size > SMALL
        ]
        return f"nothing steers {self._wheels}: no {' and no '.join(left)}" if left else ""

    def restore(self, references: References) -> None:
        """Let what is wanted be what it was: who wants it goes on from there."""
        references.velocity[:], references.vertex_velocity[:] = self._base, self._vertices
        references.turn[2] = self._turn

    def _remove(self, velocity: np.ndarray) -> float:
        """Remove what is across from a velocity, shape (3,); return how much that was [m/s]."""
        size = float(self._across.dot(velocity[:2]))
        velocity[:2] -= size * self._across
        return abs(size)
