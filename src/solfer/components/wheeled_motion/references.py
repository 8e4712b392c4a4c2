"""What is desired of base and vertices: velocities, and where these have led to."""

import math

import numpy as np

from solfer.components.wheeled_motion.kernel import HEADING, LIMITS, PACE, WAITS
from solfer.components.wheeled_motion.pace.kernel import step
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.rotations import quaternion_product


class References:
    """Desired velocities, and their integrals.

    Args:
        count: Number of wheels.

    Attributes:
        velocity: Velocity of the base in the world, shape (3,) [m/s].
        turn: Angular velocity of the base (x, y, z), of which z is the rate of the heading, shape (3,) [rad/s].
        vertex_velocity: Velocities of the vertices in the frame of the heading, shape (count, 3) [m/s].
        position: Position of the base in the world, shape (3,) [m].
        orientation: Orientation of the base, quaternion (x, y, z, w).
        vertices: Vertices in the frame of the heading: x, y from the base, z in the world, shape (count, 3) [m].
        camber: Camber of the wheels, shape (count,) [rad].
        caster: Caster of the wheels, shape (count,) [rad].
        tilt: Orientation of the base as seen from its heading, quaternion.
        lifted: Which wheels do not carry the robot, shape (count,).
        numbers: Pace, share of the limits, heading, and whether velocities wait, shape (4,).
    """

    def __init__(self, count: int):
        self._motion = np.zeros((3, 3))
        self._places = np.zeros((2, count, 3))
        self.velocity, self.turn, self.position = self._motion
        self.vertex_velocity, self.vertices = self._places
        self.camber, self.caster = np.zeros((2, count))
        self.numbers = np.zeros(4)
        self.lifted = np.zeros(count, dtype=bool)
        self._orientations = np.zeros((2, 4))
        self.orientation, self.tilt = self._orientations
        self._orientations[:, 3] = self.numbers[PACE] = self.numbers[LIMITS] = 1.0

    @property
    def pace(self) -> float:
        """Share of the velocities with which they go on."""
        return float(self.numbers[PACE])

    @pace.setter
    def pace(self, value: float) -> None:
        self.numbers[PACE] = value

    @property
    def limits(self) -> float:
        """Share of them that is not larger than it may be."""
        return float(self.numbers[LIMITS])

    @property
    def heading(self) -> float:
        """Heading of the base [rad]."""
        return float(self.numbers[HEADING])

    @heading.setter
    def heading(self, value: float) -> None:
        self.numbers[HEADING] = value

    @property
    def waits(self) -> bool:
        """Whether velocities do not count for now, since a wheel is being lifted or put down."""
        return bool(self.numbers[WAITS])

    @waits.setter
    def waits(self, value: bool) -> None:
        self.numbers[WAITS] = value

    def start(self, position: np.ndarray, heading: float, orientation: np.ndarray) -> None:
        """Begin with a base at rest, at a position [m], a heading [rad] and an orientation (quaternion)."""
        self.velocity[:] = 0.0
        self.turn[:] = 0.0
        self.vertex_velocity[:] = 0.0
        self.position[:] = position
        self.numbers[:3] = (1.0, 1.0, heading)
        self.tilt[:] = quaternion_product(about_z(-heading), orientation.tolist())
        self.orientation[:] = orientation

    def stay(self, place: np.ndarray, heading: float, vertices: np.ndarray) -> None:
        """Put base and wheels on the ground to where they are, as far as wheels have to roll for it.

        Args:
            place: Where the base is [m].
            heading: Its heading [rad].
            vertices: Where the vertices are, as `vertices`.
        """
        self.position[:2] = place[:2]
        self.heading = heading
        np.copyto(self.vertices[:, :2], vertices[:, :2], where=~self.lifted[:, None])

    def displace(self, move: PlanarMove) -> None:
        """Move with the base, whose estimate has jumped."""
        move.move(self.position)
        move.rotate(self.velocity)
        self.heading = move.turn_angle(self.heading)
        self.vertices[:, 2] += move.rise
        move.turn_orientation(self.orientation)

    def step(self, period: float) -> None:
        """Go on for a time [s], at the pace."""
        step(self._motion, self._places, self._orientations, self.numbers, period)


class KeptVelocities:
    """Desired velocities that a cycle changes, and that are the same again after it.

    Attributes:
        base: Velocity of the base, shape (3,) [m/s].
        turn: Rate of its heading [rad/s].
        vertices: Velocities of the vertices, shape (count, 3) [m/s].
    """

    def __init__(self, count: int):
        self.base = np.zeros(3)
        self.turn = 0.0
        self.vertices = np.zeros((count, 3))

    def keep(self, references: References) -> None:
        """Keep what is desired now."""
        self.base[:] = references.velocity
        self.turn = float(references.turn[2])
        self.vertices[:] = references.vertex_velocity

    def restore(self, references: References) -> None:
        """Let it be desired again."""
        references.velocity[:] = self.base
        references.turn[2] = self.turn
        references.vertex_velocity[:] = self.vertices


def about_z(angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a turn about z [rad]."""
    return 0.0, 0.0, math.sin(angle / 2.0), math.cos(angle / 2.0)
