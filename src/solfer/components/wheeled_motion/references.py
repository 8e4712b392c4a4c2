"""What is wanted of base and vertices: velocities, and where these have led to."""

import math

import numpy as np

from solfer.components.wheeled_motion.points import wrapped
from solfer.numerics.rotations import quaternion_product


class References:
    """Velocities that are wanted, and their integrals.

    Args:
        count: Number of wheels.

    Attributes:
        velocity: Velocity of the base in the world, shape (3,) [m/s].
        turn: Angular velocity of the base (x, y, z), of which z is the rate of the heading, shape (3,) [rad/s].
        vertex_velocity: Velocities of the vertices in the frame of the heading, shape (count, 3) [m/s].
        position: Position of the base in the world, shape (3,) [m].
        heading: Heading of the base [rad].
        orientation: Orientation of the base, quaternion (x, y, z, w).
        vertices: Vertices in the frame of the heading: x, y from the base, z in the world, shape (count, 3) [m].
        camber: Camber of the wheels, shape (count,) [rad].
        caster: Caster of the wheels, shape (count,) [rad].
        pace: Share of the velocities with which they go on.
        limits: Share of them that is not larger than it may be.
        lifted: Which wheels do not carry the robot, shape (count,).
        waits: Whether velocities do not count for now, since a wheel is being lifted or put down.
    """

    def __init__(self, count: int):
        self.velocity, self.turn, self.position = np.zeros((3, 3))
        self.vertex_velocity, self.vertices = np.zeros((2, count, 3))
        self.camber, self.caster = np.zeros((2, count))
        self.pace, self.limits, self.lifted = 1.0, 1.0, np.zeros(count, dtype=bool)
        self.waits = False
        self.heading, self.orientation = 0.0, np.array((0.0, 0.0, 0.0, 1.0))
        self._tilt = np.array((0.0, 0.0, 0.0, 1.0))
        self._way, self._vertex_way = np.zeros(3), np.zeros((count, 3))

    def start(self, position: np.ndarray, heading: float, orientation: np.ndarray) -> None:
        """Begin with a base at rest, at a position [m], a heading [rad] and an orientation (quaternion)."""
        self.velocity[:], self.turn[:], self.vertex_velocity[:] = 0.0, 0.0, 0.0
        self.position[:], self.heading, self.pace, self.limits = position, heading, 1.0, 1.0
        self._tilt[:] = quaternion_product(about_z(-heading), orientation.tolist())
        self.orientation[:] = orientation

    def step(self, period: float) -> None:
        """Go on for a time [s], at the pace."""
        period *= self.pace
        np.multiply(self.velocity, period, out=self._way)
        self.position += self._way
        np.multiply(self.vertex_velocity, period, out=self._vertex_way)
        self.vertices += self._vertex_way
        wx, wy, wz = self.turn.tolist()
        self.heading = wrapped(self.heading + wz * period, 2.0 * math.pi)
        if wx or wy:
            half = wx * period / 2.0, wy * period / 2.0
            roll = math.sin(half[0]), 0.0, 0.0, math.cos(half[0])
            pitch = 0.0, math.sin(half[1]), 0.0, math.cos(half[1])
            self._tilt[:] = quaternion_product(quaternion_product(roll, pitch), self._tilt.tolist())
        self.orientation[:] = quaternion_product(about_z(self.heading), self._tilt.tolist())


def about_z(angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a turn about z [rad]."""
    return 0.0, 0.0, math.sin(angle / 2.0), math.cos(angle / 2.0)
