"""Desired places of base and vertices, and how fast their references go there."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from solfer.components.wheeled_motion.pace.kernel import approach
from solfer.components.wheeled_motion.points import heading_of
from solfer.components.wheeled_motion.references import References
from solfer.errors import ComponentError, NotFinite, SizeMismatch
from solfer.interfaces.port import Port
from solfer.interfaces.support import BASE_PORT, LEAD, VELOCITIES_PORT, VERTICES_PORT
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import FURTHEST_TARGET

STREAM_TIMEOUT = 0.55
"""Time after the last velocity, or the last place of a stream, when what it drives begins to stop [s]."""


@dataclass(frozen=True)
class WheelsSupport:
    """A `solfer/WheelsSupport`: x, y, z of each vertex after the other, seen from the heading of the base.

    Attributes:
        position: Places [m]; empty: not given.
        velocity: Velocities [m/s]; empty: not given.
    """

    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()


@dataclass
class Stream:
    """Places that are received one after the other.

    Attributes:
        is_followed: Whether references go to the last one.
        is_stream: Whether the last one came soon after the one before.
        is_moving: Whether more of them are expected: the last ones moved, and the references have not arrived since.
        age: Time since the last one [s].
    """

    is_followed: bool = False
    is_stream: bool = False
    is_moving: bool = False
    age: float = math.inf

    @property
    def is_abandoned(self) -> bool:
        """Whether no more places come, though the last ones moved."""
        return self.is_followed and self.is_moving and self.age > STREAM_TIMEOUT

    def note(self, step: float, left: float) -> None:
        """Take over a place.

        Args:
            step: How far it is from the one before [m or rad].
            left: How far references are from the one before [m or rad].
        """
        goes_on = step > 0.0 or (self.is_moving and left > 1e-3)  # a sender may wait for the pace
        self.is_stream = self.is_followed and self.age <= STREAM_TIMEOUT
        self.is_moving = self.is_stream and goes_on
        self.age = 0.0
        self.is_followed = True

    def end(self) -> bool:
        """End with another one of the same sender, if this one has ceased as well; return whether it has."""
        self.is_moving = self.is_moving or (self.is_stream and self.age > STREAM_TIMEOUT)
        return self.is_abandoned


class Targets:
    """Lets references go to desired places, with limited speed and acceleration.

    A reference goes towards its place with the distance e by e / LEAD, as far as speeds and accelerations allow, by one
    ratio for base, heading and vertices. So places that are ahead of a motion by the way of the time LEAD are followed
    without a lag, and while the pace holds the motion up its direction is known.

    Vertices follow places or velocities, whichever came last; the base follows a pose, as far as nothing else drives
    it. The pace counts: a reference that was held up goes on from where it is.

    Args:
        count: Number of wheels.
        speeds: Largest speeds of the base [m/s], its heading [rad/s] and of a vertex [m/s].
        accelerations: The same of accelerations.

    Attributes:
        ports: What the component receives by pipes: the pose `base` in the world, `vertices` and `vertex_velocities`
            seen from the heading of the base.
        ratio: Factor that scales the newest velocities, or those to the newest places, to their limits.
        has_base: Whether the base goes to a pose.
    """

    has_base: bool = property(attrgetter("_base.is_followed"))  # type: ignore[assignment]  # read in each cycle

    def __init__(self, count: int, speeds: tuple[float, float, float], accelerations: tuple[float, float, float]):
        self._count = count
        self.ports = {
            BASE_PORT: Port("pose"),
            VERTICES_PORT: Port("position", count),
            VELOCITIES_PORT: Port("velocity", count),
        }
        self._desired, self._change = np.zeros((2, count, 3))
        # rows of the base, its heading, and the vertices
        self._places, self._errors = np.zeros((2, 2 + count, 3))
        self._limits = np.zeros((2 + count, 2))
        self.limit(speeds, accelerations)
        self.start()

    def limit(self, speeds: Sequence[float], accelerations: Sequence[float]) -> None:
        """Set the largest speeds and accelerations, see above."""
        self._limits[:3, 0] = speeds
        self._limits[:3, 1] = accelerations
        self._limits[3:] = self._limits[2]

    @property
    def is_active(self) -> bool:
        """Whether base or vertices go to places, or vertices follow velocities."""
        return self._base.is_followed or self._vertices.is_followed or self._age != math.inf

    @property
    def is_abandoned(self) -> bool:
        """Whether base or vertices brake since nothing comes any more, though the last ones were to go on."""
        return self.are_places_abandoned or (STREAM_TIMEOUT < self._age < math.inf and bool(self._desired.any()))

    @property
    def are_places_abandoned(self) -> bool:
        """The same of places alone."""
        return self._base.is_abandoned or self._vertices.is_abandoned

    def start(self) -> None:
        """Begin without targets."""
        self._base, self._vertices = Stream(), Stream()
        self._age = math.inf
        self.ratio = 1.0

    def read(self) -> str:
        """Take over what the ports have received; return what is wrong with it, empty if nothing is."""
        wrong = ""
        for name, port in self.ports.items():
            if not port.fresh:
                continue
            if not (abs(port.value) <= FURTHEST_TARGET).all():
                wrong = f"'{name}' is not finite, or has a number beyond {FURTHEST_TARGET:g}"
            elif name == BASE_PORT:
                wrong = self._aim_base(port.value) or wrong
            elif name == VERTICES_PORT:
                wrong = self._aim_vertices(port.value) or wrong
            else:
                self._aim_velocities(port.value)
        return wrong

    def receive(self, message: WheelsSupport) -> None:
        """Take over a message; nothing changes if a part of it is wrong.

        Raises:
            SizeMismatch: There are not three numbers for each wheel.
            NotFinite: One is NaN or infinite.
            ComponentError: Places jump.
        """
        for what, numbers in (("position", message.position), ("velocity", message.velocity)):
            check(what, numbers, 3 * self._count)
        if message.position and (wrong := self._aim_vertices(np.reshape(message.position, (-1, 3)))):
            raise ComponentError(wrong, where="position", expected="places that move")
        if message.velocity:
            self._aim_velocities(np.reshape(message.velocity, (-1, 3)))

    def leave_base(self) -> None:
        """Let the base alone: something else drives it."""
        self._base = Stream()

    def leave_vertices(self) -> None:
        """Let the vertices alone: one stands elsewhere now."""
        self._vertices = Stream()
        self._age = math.inf

    def displace(self, move: PlanarMove) -> None:
        """Move with the base, whose estimate has jumped; vertices are seen from it, but for their heights."""
        move.move(self._places[0])
        self._places[1, 2] = move.rotate_heading(self._places[1, 2])
        self._places[2:, 2] += move.rise

    def update(self, references: References, ratio: float, passed: float) -> None:
        """Write the velocities of this cycle to the references.

        Args:
            references: The desired motion.
            ratio: Factor of the received velocities.
            passed: Time since the cycle before [s].
        """
        if self._base.is_followed or self._vertices.is_followed:
            self._approach(references, passed)
        if self._age != math.inf:
            self._drive_vertices(references, ratio, passed)

    def _approach(self, references: References, passed: float) -> None:
        """Go to places from where the references are; what is abandoned comes to rest."""
        errors = self._errors
        places = self._places
        np.subtract(places[0], references.position, out=errors[0])
        errors[1, 2] = math.remainder(places[1, 2] - references.heading, math.tau)
        np.subtract(places[2:], references.vertices, out=errors[2:])
        # how high a wheel on the ground is, the ground says
        np.copyto(errors[2:, 2], 0.0, where=~references.lifted)
        moving = references.velocity, references.angular, references.vertex_velocity
        base_ends = self._base.is_abandoned
        vertices_end = self._vertices.is_abandoned
        if base_ends != vertices_end:
            base_ends = self._base.end()
            vertices_end = self._vertices.end()
        if base_ends:
            errors[:2] = 0.0
        if vertices_end:
            errors[2:] = 0.0
        first = 0 if self._base.is_followed else 2
        last = 2 + self._vertices.is_followed * self._count
        vertex_velocity = references.vertex_velocity
        self.ratio = approach(errors, self._limits, references.motion, vertex_velocity, first, last, LEAD, passed)
        for stream, ends, rates in ((self._base, base_ends, moving[:2]), (self._vertices, vertices_end, moving[2:])):
            stream.age += passed
            if ends and not any(rate.any() for rate in rates):
                stream.is_followed = False
                self.ratio = 1.0

    def _drive_vertices(self, references: References, ratio: float, passed: float) -> None:
        """Follow velocities; without new ones come to rest."""
        self._age += passed
        velocity = references.vertex_velocity
        most = self._limits[2, 1] * passed
        np.multiply(self._desired, ratio, out=self._change)
        np.subtract(self._change, velocity, out=self._change)
        if self._age > STREAM_TIMEOUT:
            np.negative(velocity, out=self._change)
        for change in self._change:
            size = math.sqrt(float(change.dot(change)))
            if size > most:
                change *= most / size
        velocity += self._change
        if self._age > STREAM_TIMEOUT and not velocity.any():
            self._age = math.inf
            self.ratio = 1.0

    def _aim_base(self, pose: np.ndarray) -> str:
        """Take over a desired pose, of whose orientation the heading counts; return what is wrong with it."""
        if abs(float(pose[3:].dot(pose[3:])) - 1.0) > 1e-3:
            return f"'{BASE_PORT}' has a quaternion that has not the length 1"
        heading = heading_of(pose)
        step = float(np.linalg.norm(pose[:3] - self._places[0]))
        yaw = abs(math.remainder(heading - self._places[1, 2], math.tau))
        if (
            self._base.is_moving
            and self._base.age <= STREAM_TIMEOUT
            and (step > 0.3 or yaw > 0.5)  # [m, rad] from which on a place is a mistake
        ):
            return f"'{BASE_PORT}' jumps by {step:.2f} m and {yaw:.2f} rad"
        self._base.note(step + yaw, left=float(np.abs(self._errors[:2]).max()))
        self._places[0] = pose[:3]
        self._places[1, 2] = heading
        return ""

    def _aim_vertices(self, places: np.ndarray) -> str:
        """Take over desired places of the vertices, z for lifted ones only; return what is wrong with them."""
        step = float(np.linalg.norm(places - self._places[2:], axis=1).max())
        if self._vertices.is_moving and self._vertices.age <= STREAM_TIMEOUT and step > 0.3:
            return f"'{VERTICES_PORT}' jump by {step:.2f} m"
        self._age = math.inf
        self._vertices.note(step, left=float(np.abs(self._errors[2:]).max()))
        self._places[2:] = places
        return ""

    def _aim_velocities(self, velocities: np.ndarray) -> None:
        """Take over desired velocities of the vertices."""
        self._desired[:] = velocities
        fastest = max(math.hypot(*velocity) for velocity in self._desired.tolist())
        self.ratio = min(1.0, float(self._limits[2, 0]) / max(fastest, 1e-12))
        self._age, self._vertices = 0.0, Stream()


def check(what: str, numbers: Sequence[float], size: int) -> None:
    """Check an array of a message, which may be empty.

    Raises:
        SizeMismatch: It has not `size` numbers.
        NotFinite: One is NaN or infinite, or far beyond any place or speed.
    """
    if numbers and len(numbers) != size:
        raise SizeMismatch(f"{len(numbers)} numbers", where=what, expected=f"{size}, or none")
    if not all(map(math.isfinite, numbers)):
        raise NotFinite("a number that is not finite", where=what, expected="finite numbers")
    if any(abs(number) > FURTHEST_TARGET for number in numbers):
        raise NotFinite(f"{max(numbers, key=abs):g}", where=what, expected=f"numbers of up to {FURTHEST_TARGET:g}")
