"""What is desired of base and vertices: velocities, and where these have led to."""

import numpy as np

from solfer.components.wheeled_motion.kernel import FLOOR, GROUND, HEADING, LIMIT_RATIO, PACE, WAITS
from solfer.components.wheeled_motion.pace.kernel import step
from solfer.numerics.planar_move import PlanarMove, about_z
from solfer.numerics.rotations import quaternion_product


class References:
    """Desired velocities, and their integrals.

    Args:
        count: Number of wheels.

    Attributes:
        velocity: Velocity of the base in the world, shape (3,) [m/s].
        angular: Angular velocity of the base (x, y, z), of which z is the rate of the heading, shape (3,) [rad/s].
        vertex_velocity: Velocities of the vertices in the frame of the heading, shape (count, 3) [m/s].
        position: Position of the base in the world, shape (3,) [m]; its height is that above the ground where it began.
        orientation: Orientation of the base, quaternion (x, y, z, w).
        vertices: Vertices in the frame of the heading: x, y from the base, z in the world, shape (count, 3) [m].
        camber: Camber of the wheels, shape (count,) [rad].
        caster: Caster of the wheels, shape (count,) [rad].
        tilt: Orientation of the base as seen from its heading, quaternion.
        lifted: Which wheels do not carry the robot, shape (count,).
        motion: Velocity, angular velocity and position, shape (3, 3).
        places: Velocities of the vertices, and vertices, shape (2, count, 3).
        orientations: Orientation and tilt, shape (2, 4).
        numbers: Pace, factor by the limits, heading, whether velocities wait, and heights of the ground, shape (6,).
    """

    def __init__(self, count: int):
        self.motion = np.zeros((3, 3))
        self.places = np.zeros((2, count, 3))
        self.velocity, self.angular, self.position = self.motion
        self.vertex_velocity, self.vertices = self.places
        self.camber, self.caster = np.zeros((2, count))
        self.numbers = np.zeros(6)
        self.lifted = np.zeros(count, dtype=bool)
        self.orientations = np.zeros((2, 4))
        self.orientation, self.tilt = self.orientations
        self.orientations[:, 3] = self.numbers[PACE] = self.numbers[LIMIT_RATIO] = 1.0

    @property
    def pace(self) -> float:
        """Factor of the velocities with which they go on."""
        return float(self.numbers[PACE])

    @pace.setter
    def pace(self, value: float) -> None:
        self.numbers[PACE] = value

    @property
    def limits(self) -> float:
        """Factor that scales them to their limits."""
        return float(self.numbers[LIMIT_RATIO])

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

    @property
    def going(self) -> float:
        """The pace; 0 while velocities do not count."""
        return 0.0 if self.numbers[WAITS] else float(self.numbers[PACE])

    @property
    def rise(self) -> float:
        """How much higher the ground is than where it began [m]."""
        return float(self.numbers[GROUND] - self.numbers[FLOOR])

    def start(self, position: np.ndarray, heading: float, orientation: np.ndarray) -> None:
        """Begin with a base at rest, at a position [m], a heading [rad] and an orientation (quaternion)."""
        self.velocity[:] = 0.0
        self.angular[:] = 0.0
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
        self.heading = move.rotate_heading(self.heading)
        self.vertices[:, 2] += move.rise
        self.numbers[FLOOR:] += move.rise
        move.rotate_orientation(self.orientation)

    def step(self, period: float) -> None:
        """Go on for a time [s], at the pace."""
        step(self.motion, self.places, self.orientations, self.numbers, period)


class KeptVelocities:
    """Desired velocities that a cycle changes, and that are the same again after it.

    Attributes:
        base: Velocity of the base, shape (3,) [m/s].
        yaw_rate: Rate of its heading [rad/s].
        vertices: Velocities of the vertices, shape (count, 3) [m/s].
    """

    def __init__(self, count: int):
        self.base = np.zeros(3)
        self.yaw_rate = 0.0
        self.vertices = np.zeros((count, 3))

    def keep(self, references: References) -> None:
        """Keep what is desired now."""
        self.base[:] = references.velocity
        self.yaw_rate = float(references.angular[2])
        self.vertices[:] = references.vertex_velocity

    def restore(self, references: References) -> None:
        """Let it be desired again."""
        references.velocity[:] = self.base
        references.angular[2] = self.yaw_rate
        references.vertex_velocity[:] = self.vertices
