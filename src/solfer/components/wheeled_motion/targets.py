"""Places that others want of base and vertices, and how fast they go there."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solfer.components.port import Port
from solfer.components.wheeled_motion.points import heading_of
from solfer.components.wheeled_motion.references import References, about_z
from solfer.errors import NotFinite, SizeMismatch
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import NOT_A_TURN, NOT_FINITE, ReferenceFilter

PATIENCE = 0.55
"""Time after the last velocity when what it drives begins to stop [s]."""

BASE_PORT, VERTICES_PORT, VELOCITIES_PORT = "base", "vertices", "vertex_velocities"
"""Inputs of the component."""


@dataclass(frozen=True)
class WheelsSupport:
    """A `solfer/WheelsSupport`: x, y, z of each vertex in turn, seen from the heading of the base.

    Attributes:
        position: Places [m]; empty: not given.
        velocity: Velocities [m/s]; empty: not given.
    """

    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()


class Targets:
    """Lets references go where others want them, with limited speed and acceleration.

    Vertices follow places or velocities, whichever came last; the base follows a pose, as far as nothing else drives
    it. The pace counts: a reference that was held up goes on from where it is.

    Args:
        count: Number of wheels.
        speeds: Largest speeds of the base [m/s], its heading [rad/s] and of a vertex [m/s].
        accelerations: The same of accelerations.

    Attributes:
        ports: What the component receives by pipes: the pose `base` in the world, `vertices` and `vertex_velocities`
            seen from the heading of the base.
        has_base: Whether the base goes to a pose.
        share: Share of the newest velocities of the vertices that is not larger than it may be.
    """

    def __init__(self, count: int, speeds: tuple[float, float, float], accelerations: tuple[float, float, float]):
        self._count, self._speeds, self._accelerations = count, speeds, accelerations
        self.ports = {
            BASE_PORT: Port("pose"),
            VERTICES_PORT: Port("position", count),
            VELOCITIES_PORT: Port("velocity", count),
        }
        self._wanted, self._change = np.zeros((2, count, 3))
        self._pose, self._place = np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)), np.zeros(3)
        self._age = math.inf
        self.has_base, self._has_vertices, self.share = False, False, 1.0

    @property
    def is_abandoned(self) -> bool:
        """Whether vertices brake since no velocities come any more, though the last ones were to go on."""
        return PATIENCE < self._age < math.inf and bool(self._wanted.any())

    def set_period(self, period: float) -> None:
        """Set the period of the control cycle [s]."""
        self._filter = ReferenceFilter(1 + self._count, period)
        (speed, turn, vertex), (change, turn_change, vertex_change) = self._speeds, self._accelerations
        self._filter.limits[0] = speed, change, turn, turn_change
        self._filter.limits[1:, :2] = vertex, vertex_change

    def set_step(self, step: float) -> None:
        """Set the time by which the next cycle goes on [s]."""
        self._filter.period = step

    def start(self) -> None:
        """Begin without targets."""
        self._age, self.has_base, self._has_vertices, self.share = math.inf, False, False, 1.0

    def read(self, references: References) -> str:
        """Take over what the ports have received; return what is wrong with it, empty if nothing is."""
        wrong = ""
        for name, port in self.ports.items():
            if not port.fresh:
                continue
            if not np.isfinite(port.value).all():
                wrong = f"'{name}' is not finite"
            elif name == BASE_PORT:
                wrong = self._aim_base(port.value, references) or wrong
            elif name == VERTICES_PORT:
                self._aim_vertices(port.value, references)
            else:
                self._want_velocities(port.value)
        return wrong

    def receive(self, message: WheelsSupport, references: References) -> None:
        """Take over a message; nothing changes if a part of it is wrong.

        Raises:
            SizeMismatch: There are not three numbers for each wheel.
            NotFinite: One is NaN or infinite.
        """
        for what, numbers in (("position", message.position), ("velocity", message.velocity)):
            check(what, numbers, 3 * self._count)
        if message.position:
            self._aim_vertices(np.reshape(message.position, (-1, 3)), references)
        if message.velocity:
            self._want_velocities(np.reshape(message.velocity, (-1, 3)))

    def leave_base(self) -> None:
        """Let the base alone: something else drives it."""
        self.has_base = False

    def displace(self, move: PlanarMove) -> None:
        """Move with the base, whose estimate has jumped; vertices are seen from it, but for their heights."""
        self._filter.displace(0, move)
        for numbers in (self._filter.target, self._filter.value):
            numbers[1:, 2] += move.rise

    def update(self, references: References, share: float, passed: float) -> None:
        """Write the velocities of this cycle to the references.

        Args:
            references: What is wanted.
            share: Share of the velocities that others want that counts.
            passed: Time since the cycle before [s].
        """
        if self.has_base or self._has_vertices:
            self._follow(references)
        if self._age != math.inf:
            self._drive_vertices(references, share, passed)

    def _follow(self, references: References) -> None:
        """Go to places, from where the references are."""
        value, rate = self._filter.value, self._filter.rate
        value[0, :3], value[0, 3:] = references.position, about_z(references.heading)
        value[1:, :3] = references.vertices
        self._filter.update()
        if self.has_base:
            references.velocity[:], references.turn[2] = rate[0, :3], rate[0, 5]
        if self._has_vertices:
            references.vertex_velocity[:] = rate[1:, :3]

    def _drive_vertices(self, references: References, share: float, passed: float) -> None:
        """Follow velocities; without new ones come to rest."""
        self._age += passed
        velocity, most = references.vertex_velocity, self._accelerations[2] * passed
        np.multiply(self._wanted, share, out=self._change)
        np.subtract(self._change, velocity, out=self._change)
        if self._age > PATIENCE:
            np.negative(velocity, out=self._change)
        for change in self._change:
            size = math.sqrt(float(change.dot(change)))
            if size > most:
                change *= most / size
        velocity += self._change
        if self._age > PATIENCE and not velocity.any():
            self._age, self.share = math.inf, 1.0

    def _aim_base(self, pose: np.ndarray, references: References) -> str:
        """Want a pose of the base, of whose orientation the heading counts; return what is wrong with it."""
        if abs(float(pose[3:].dot(pose[3:])) - 1.0) > 1e-3:
            return f"'{BASE_PORT}' has a quaternion that has not the length 1"
        self._place[:] = pose[:3]
        self._pose[:3], self._pose[3:] = pose[:3], about_z(heading_of(pose))
        if not self.has_base:
            self._begin(0, references.velocity, references.turn[2])
        self.has_base = True
        outcome = self._filter.aim(0, self._pose, 0, True)
        assert outcome not in (NOT_FINITE, NOT_A_TURN)
        return ""

    def _aim_vertices(self, places: np.ndarray, references: References) -> None:
        """Want places of the vertices, of which x and y count, and z of those that are lifted."""
        self._age, self.share = math.inf, 1.0
        for index, place in enumerate(places):
            if not self._has_vertices:
                self._begin(1 + index, references.vertex_velocity[index], 0.0)
            self._place[:] = place
            if not references.lifted[index]:
                self._place[2] = references.vertices[index, 2]  # how high it is, the ground says
            self._filter.aim(1 + index, self._place, 0, True)
        self._has_vertices = True

    def _begin(self, index: int, velocity: np.ndarray, turn: float) -> None:
        """Go on with the velocity that a reference has."""
        self._filter.rate[index, :3], self._filter.rate[index, 3:5], self._filter.rate[index, 5] = velocity, 0.0, turn

    def _want_velocities(self, velocities: np.ndarray) -> None:
        """Want velocities of the vertices."""
        self._wanted[:] = velocities
        fastest = max(math.hypot(*velocity) for velocity in self._wanted.tolist())
        self.share = min(1.0, self._speeds[2] / max(fastest, 1e-12))
        self._age, self._has_vertices = 0.0, False


def check(what: str, numbers: Sequence[float], size: int) -> None:
    """Check an array of a message, which may be empty.

    Raises:
        SizeMismatch: It has not `size` numbers.
        NotFinite: One is NaN or infinite.
    """
    if numbers and len(numbers) != size:
        raise SizeMismatch(f"{len(numbers)} numbers", where=what, expected=f"{size}, or none")
    if not all(map(math.isfinite, numbers)):
        raise NotFinite("a number that is not finite", where=what, expected="finite numbers")
