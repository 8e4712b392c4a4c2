"""Courses by velocities: what is desired of base and vertices, second by second."""

import math
from typing import NamedTuple

import numpy as np

from solfer.components.wheeled_motion.references import References

ACCELERATION, TURN_ACCELERATION, VERTEX_ACCELERATION = 0.3, 0.5, 0.2
"""Most that velocities change [m/s2, rad/s2, m/s2]."""

SIDES, ENDS = np.array((1.0, -1.0, 1.0, -1.0)), np.array((1.0, 1.0, -1.0, -1.0))
"""Where wheels are, to the left and to the front of the base."""

REST = 2.0
"""Time at rest at the end [s]."""


class Part(NamedTuple):
    """A part of a course.

    Attributes:
        duration: How long it takes [s].
        x, y, turn: Velocity of the base seen from its heading [m/s], and rate of the heading [rad/s].
        wider, longer: Speed of each vertex away from the middle, to the sides and to the ends [m/s].
        up: Speed of the base upwards [m/s].
    """

    duration: float
    x: float = 0.0
    y: float = 0.0
    turn: float = 0.0
    wider: float = 0.0
    longer: float = 0.0
    up: float = 0.0


FORTH_AND_BACK = (0.02, -0.02)  # [m/s]


def _reshaping(**motion: float) -> tuple[Part, ...]:
    """Make the footprint narrower by 0.16 m and wider again, in motion."""
    return (Part(2.0, **motion), *(Part(4.0, wider=-speed, **motion) for speed in FORTH_AND_BACK), Part(1.0, **motion))


def _to_a_posture(sides: float, ends: float, height: float, duration: float) -> tuple[Part, ...]:
    """Move the vertices to the sides and to the ends and the base upwards [m], each for a time [s], and back again."""
    speeds = sides / duration, ends / duration, height / duration
    there, back = (Part(duration, 0.0, 0.0, 0.0, *(sign * speed for speed in speeds)) for sign in (1.0, -1.0))
    return there, Part(2.0), back


COURSES: dict[str, tuple[Part, ...]] = {
    "slow": (Part(6.0, 0.05),),
    "forward": (Part(5.0, 0.2),),
    "fast": (Part(4.0, 0.3),),
    "far": (Part(15.0, 0.2),),
    "backward": (Part(5.0, -0.2),),
    "turn": (Part(8.0, turn=0.3),),
    "circle": (Part(10.0, 0.2, turn=0.4),),
    "sideways": (Part(6.0, y=0.1),),
    "diagonal": (Part(5.0, 0.1, 0.1),),
    "corner": (Part(3.0, 0.15), Part(3.0, y=0.15), Part(3.0, -0.15)),
    "narrow": _reshaping(),
    "narrow_forward": _reshaping(x=0.2),
    "narrow_circle": _reshaping(x=0.2, turn=0.3),
    "narrow_turn": _reshaping(turn=0.3),
    # from CENTAURO's `mammal_wide_straight` to the vertices of its `narrow`, nearly as high
    "state_narrow": _to_a_posture(-0.223, -0.205, 0.28, 12.0),
    "long": (Part(3.0, longer=0.02), Part(3.0, longer=-0.02)),
}


def mixed(seed: int, duration: float = 20.0) -> tuple[Part, ...]:
    """Draw a course."""
    random, parts = np.random.default_rng(seed), []
    wide = 0.0
    while duration > 0.0:
        time = min(float(random.uniform(1.5, 3.0)), duration)
        heading, speed = random.uniform(-math.pi, math.pi), random.uniform(0.0, 0.2)
        # the footprint stays within 0.1 m of its width
        wider = float(np.clip(random.uniform(-0.03, 0.03), (-0.1 - wide) / time, (0.05 - wide) / time))
        wide += wider * time
        x, y = speed * math.cos(heading), speed * math.sin(heading)
        parts.append(Part(time, x, y, float(random.uniform(-0.25, 0.25)), wider))
        duration -= time
    return tuple(parts)


class Profile:
    """Velocities of a course that change no faster than they may.

    Args:
        parts: The course.
        period: Time of a cycle [s].

    Attributes:
        base: Velocity (x, y) seen from the heading and rate of the heading, shape (3,) [m/s, rad/s].
        vertices: Velocities of the vertices seen from the heading, shape (4, 3) [m/s].
        up: Speed of the base upwards [m/s].
        grounded: Which wheels carry the robot, shape (4,): all.
        is_over: Whether the course is over, and all is at rest.
    """

    def __init__(self, parts: tuple[Part, ...], period: float):
        self._ends, self._parts = np.cumsum([part.duration for part in parts]), parts
        self._period, self._time = period, 0.0
        self.base, self.vertices, self.is_over = np.zeros(3), np.zeros((4, 3)), False
        self.up = 0.0
        self.grounded = np.ones(4, dtype=bool)

    def step(self, pace: float = 1.0) -> None:
        """Go on for a cycle, of whose time a share `pace` counts for the course."""
        index = int(np.searchsorted(self._ends, self._time, side="right"))
        part = self._parts[index] if index < len(self._parts) else Part(math.inf)
        self._time += pace * self._period
        change = np.array((part.x, part.y)) - self.base[:2]
        self.base[:2] += _shortened(change, ACCELERATION * self._period)
        self.base[2] += _shortened(np.array((part.turn,)) - self.base[2], TURN_ACCELERATION * self._period)[0]
        self.up += _shortened(np.array((part.up,)) - self.up, VERTEX_ACCELERATION * self._period)[0]
        for column, desired in ((0, part.longer * ENDS), (1, part.wider * SIDES)):
            change = desired - self.vertices[:, column]
            self.vertices[:, column] += _shortened(change, VERTEX_ACCELERATION * self._period)
        self.is_over = index >= len(self._parts) and not (self.base.any() or self.vertices.any() or self.up)

    def begin(self, references: References) -> None:
        """Do nothing: a course is seen from the heading of the references."""

    def write(self, references: References) -> None:
        """Write the velocities of this cycle."""
        cos, sin = math.cos(references.heading), math.sin(references.heading)
        x, y, turn = self.base.tolist()
        references.velocity[:] = cos * x - sin * y, sin * x + cos * y, self.up
        references.angular[2] = turn
        references.vertex_velocity[:] = self.vertices

    @property
    def duration(self) -> float:
        """How long it takes from its begin if nothing slows it down [s]."""
        profile, cycles = Profile(self._parts, self._period), 0
        while not profile.is_over:
            profile.step()
            cycles += 1
        return cycles * self._period


def _shortened(vector: np.ndarray, length: float) -> np.ndarray:
    """Return a vector of no more than a length."""
    size = float(np.linalg.norm(vector))
    return vector if size <= length else vector * (length / size)
