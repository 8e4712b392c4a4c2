"""How fast a motion goes along its path: no faster than wheels and joints can follow."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solfer.components.wheeled_motion.kernel import feed_forward
from solfer.components.wheeled_motion.points import RollingOffsets
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.steering import Steering
from solfer.components.wheeled_motion.tags import BASE, STEERING, VERTICES

SIDEWAYS = 3e-3
"""Speed across a wheel with which its vertex may leave its way [m/s]."""

LACK = 1e-3
"""What velocities may lack of what is wanted, where joints are at their bounds [m/s, rad/s]."""

SLOWER, FASTER = 8.0, 1.0
"""How fast the pace falls and rises where joints are at their bounds [1/s]."""

BRAKING, STARTING = 4.0, 3.0
"""By how much more than `acceleration` vertices brake for the pace, and start where a faster motion is wanted."""


TOLD, NEWS = 0.1, 0.02
"""Longest time between two messages of the pace [s], and by how much it changes before one goes out at once."""


@dataclass(frozen=True)
class MotionPace:
    """A `std_msgs/Float64`: the share of the velocities of others with which the motion goes on, from 0 to 1."""

    data: float = 1.0


class PaceTeller:
    """Publishes the pace, where it changes and now and then.

    Args:
        pace: Returns the present one.
        period: Period of the control cycle [s].
    """

    def __init__(self, pace: Callable[[], float], period: float):
        self._pace, self._cycles = pace, max(1, round(TOLD / period))
        self._left, self._told = 0, 1.0

    def collect(self) -> MotionPace | None:
        """Return what is to be published after this cycle; None: nothing."""
        self._left -= 1
        pace = self._pace()
        if self._left > 0 and abs(pace - self._told) < NEWS:
            return None
        self._left, self._told = self._cycles, pace
        return MotionPace(pace)


class PathPace:
    """The share of all wanted velocities that goes on, from 0 to 1.

    No velocity is larger than it may be. A wheel that does not point to where it aims leaves its way with the speed
    v |sin d|, with the speed v that is wanted of its vertex and the angle d between both: the pace keeps it below
    SIDEWAYS. It also falls as long as joints at their bounds leave base or vertices slower than they are wanted. Speeds
    along the path change no faster than `acceleration`, and fall BRAKING times as fast; where velocities jump to larger
    ones, vertices follow with STARTING times the acceleration.

    Args:
        speeds: Largest speeds of the base [m/s], its heading [rad/s] and of a vertex [m/s].
        acceleration: Largest change of a vertex' speed by the pace [m/s2].
        period: Period of the control cycle [s].

    Attributes:
        value: The pace.
        most: Share of the velocities that is not larger than it may be.
        held: Share that joints at their bounds leave.
    """

    def __init__(self, speeds: tuple[float, float, float], acceleration: float, period: float):
        self._speeds, self._step, self._period = speeds, acceleration * period, period
        self.start()

    def start(self) -> None:
        """Begin without a motion, which could go on in full."""
        self.value = self.held = self.most = 1.0
        self._share, self._speed = 1.0, 0.0

    def limit(self, references: References) -> float:
        """Compute and return the share of what is wanted that is not larger than it may be."""
        base, turn, vertex = self._speeds
        x, y, z = references.velocity.tolist()
        share = base / max(base, math.hypot(x, y, z))
        share = min(share, turn / max(turn, abs(float(references.turn[2]))))
        for each in references.vertex_velocity.tolist():
            share = min(share, vertex / max(vertex, math.hypot(*each)))
        self.most, self.value = share, share * self._share
        return share

    def update(self, steering: Steering, angles: np.ndarray, heading: float, is_held: bool) -> float:
        """Compute and return the pace of this cycle.

        Args:
            steering: Where wheels aim, and how fast they are wanted, of which `most` is the share that is wanted.
            angles: Directions of the wheels in the world, shape (m,) [rad].
            heading: Heading of the base [rad].
            is_held: Whether joints at their bounds hold the motion up.
        """
        fastest, across = 0.0, SIDEWAYS
        for speed, aim, angle in zip(steering.speeds.tolist(), steering.aims.tolist(), angles.tolist(), strict=True):
            fastest = max(fastest, speed)
            across = max(across, speed * abs(math.sin(aim - angle + heading)))
        change = (-SLOWER if is_held else FASTER) * self._period
        self.held = min(max(self.held + change, 0.0), 1.0)
        share = min(SIDEWAYS / across, self.held)
        if fastest > 0.0:
            before, step = self._share, self._step / fastest
            least = min(before, self._speed / fastest) - BRAKING * step
            share = min(max(share, least), before + step, self._speed / fastest + STARTING * step)
        self._share, self._speed = share, share * fastest
        self.value = share * self.most
        return self.value


class WantedRates:
    """Rates of the tasks that are wanted, and what they lack where joints are at their bounds.

    Args:
        rows: Rows of each task.
        size: Number of all rows.
        base_speed: Largest speed with which errors of the base go away [m/s, rad/s].
        vertex_speed: The same of vertices [m/s].

    Attributes:
        wanted: Velocities that are wanted of base and vertices, whole, as of the last `forward`, shape (size,).
    """

    def __init__(self, rows: dict[str, slice], size: int, base_speed: float, vertex_speed: float):
        self._rows, self._limits = rows, ((BASE, base_speed), (VERTICES, vertex_speed))
        self._errors, self.wanted, self._paced = np.zeros((3, size))
        self._fed = tuple(self.wanted[rows.get(name, slice(0, 0))] for name in (BASE, STEERING, VERTICES))

    def limit(self, rates: np.ndarray) -> None:
        """Let no error move vertices or base faster than they may be."""
        for name, most in self._limits:
            if name in self._rows:
                rows = rates[self._rows[name]]
                np.minimum(rows, most, out=rows)
                np.maximum(rows, -most, out=rows)

    def forward(self, references: References, offsets: RollingOffsets) -> np.ndarray:
        """Compute and return the velocities that are wanted of base and vertices, at the pace; live, shape (size,)."""
        feed_forward(
            *self._fed,
            references.velocity,
            references.turn,
            offsets.directions,
            references.vertex_velocity,
            references.lifted,
            offsets.heading,
        )
        return np.multiply(self.wanted, references.pace, out=self._paced)

    def remember(self, rates: np.ndarray) -> None:
        """Note the rates by which errors go away, shape (size,)."""
        self._errors[:] = rates

    @property
    def lacks(self) -> bool:
        """Whether base and vertices are behind along the way that they are to go.

        It is told by the rates with which errors would go away along that way. Where the way leads back to where joints
        can follow, it is not held up.
        """
        along = square = 0.0
        for name, _ in self._limits:
            if name in self._rows:
                forward = self.wanted[self._rows[name]]
                along += float(self._errors[self._rows[name]].dot(forward))
                square += float(forward.dot(forward))
        return along > LACK * math.sqrt(square)
