"""Desired velocities that wheels without steering cannot follow."""

from collections.abc import Sequence

import numpy as np

from solfer.components.wheeled_motion.references import KeptVelocities, References
from solfer.numerics.planar_move import seen_from


class StraightAhead:
    """Removes from the desired velocities what wheels without steering cannot do: motions across them, and yaw rates.

    Velocities along the wheels and heights stay. The wheels are parallel; the direction of the first one counts.

    Args:
        wheels: Names of the wheels.
    """

    def __init__(self, wheels: Sequence[str]):
        self._wheels = ", ".join(f"'{wheel}'" for wheel in wheels)
        self._across = np.zeros(2)
        self._kept = KeptVelocities(len(wheels))

    def update(self, references: References, direction: np.ndarray, heading: float) -> str:
        """Change the desired velocities until `restore`; return what is left out, empty if nothing is.

        Args:
            references: The desired velocities.
            direction: Direction in which the wheels roll in the world, shape (2,).
            heading: Heading of the base [rad].
        """
        self._kept.keep(references)
        dx, dy = direction.tolist()
        self._across[:] = -dy, dx
        base = self._remove(references.velocity)
        self._across[:] = seen_from(heading, -dy, dx)
        footprint = 0.0
        for velocity, is_lifted in zip(references.vertex_velocity, references.lifted.tolist(), strict=True):
            footprint = max(footprint, 0.0 if is_lifted else self._remove(velocity))
        yaw_rate = abs(self._kept.yaw_rate)
        references.angular[2] = 0.0
        left = [
            text
            for size, text in (
                (base, f"{base:.3g} m/s sideways"),
                (yaw_rate, f"turns of {yaw_rate:.3g} rad/s"),
                (footprint, f"footprints that change by {footprint:.3g} m/s to the side"),
            )
            if size > 1e-6  # [m/s, rad/s]
        ]
        return f"nothing steers {self._wheels}: no {' and no '.join(left)}" if left else ""

    def restore(self, references: References) -> None:
        """Restore the velocities that `update` changed."""
        self._kept.restore(references)

    def _remove(self, velocity: np.ndarray) -> float:
        """Remove what is across from a velocity, shape (3,); return how much that was [m/s]."""
        size = float(self._across.dot(velocity[:2]))
        velocity[:2] -= size * self._across
        return abs(size)
