"""A task with the reference that others give it."""

import math

import numpy as np

from solfer.components.following.tags import MotionRecord
from solfer.components.port import Port
from solfer.config.kinds.point import QUANTITIES
from solfer.errors import ComponentError, NotFinite, SizeMismatch, UnknownName
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import NOT_A_TURN, NOT_FINITE, ReferenceFilter
from solfer.numerics.rotations import quaternion_product
from solfer.points import Constant, LookAt
from solfer.points.space import ORIENTATION, POSE
from solfer.references import ReferenceGenerator
from solfer.tasks import Task

CHECK, CHECKS = 0.02, 5
"""Time between two looks at whether a task still comes nearer to its reference [s], and how many it may not."""

CREEP, GROWTH = 1e-3, 0.2
"""Share of the rate that its gain asks for below which it does not: the rest would take a thousand times as long. It
grows by the factor e in each time of the second number [s] that the reference has been at rest: what an arm gains by
swinging on gets less and less, and it comes to rest in any case."""

TAKEOVERS = 5
"""Cycles in which a task that is to stay where it is takes its place over, until it is at rest there."""

WORLD = "world"


class Target:
    """A task, its reference, and what is requested of it.

    Args:
        name: Name of the task.
        task: The task.
        reference: What it follows: a position, an orientation or a pose.
        frame: Name of the frame that the reference is in, for what comes from outside.
        generator: Generates the reference until one comes from outside; None: it stays where it is.

    Attributes:
        name: Name of the task.
        task: The task.
        frame: Name of the frame.
        quantity: 'position', 'orientation' or 'pose'.
        port: Receives references.
        residual: Distance of point and reference as of the last cycle [m], and their angle [rad], shape (2,).
        stays: Whether the point's distance from a reference at rest does not change any more.
        is_unreachable: Whether the task has come to rest away from its reference.
        is_held: Whether it follows the place where it came to rest instead.
        reason: Why it came to rest away from its reference, the last time.
    """

    def __init__(
        self, name: str, task: Task, reference: Constant, frame: str, generator: ReferenceGenerator | None = None
    ):
        self.name = name
        self.task = task
        self.frame = frame
        self._reference = reference
        self.quantity = quantity_of(reference)
        self._first = 3 if self.quantity == "orientation" else 0
        self._size = QUANTITIES[self.quantity]
        self.port = Port(self.quantity)
        self._gain = float(task.gain.max())
        # live; assigning to `task.velocity` would check it
        self._correction = task.correction.copy()
        self._velocity, self._own_velocity, self._fed = task.velocity, task.velocity.copy(), np.zeros(task.rows)
        self._moves = not isinstance(task.point, LookAt)
        self.residual = np.zeros(2)
        self.stays = self.is_unreachable = self.is_held = self._was_received = False
        self.reason = ""
        self._last = math.inf
        self._cycles = 0
        self._looks = 0
        self._takeovers = TAKEOVERS
        self._stamp = -math.inf
        self._creep = CREEP
        self._filter: ReferenceFilter
        self._generator = generator
        self._is_generated = False
        self._time = 0.0
        self._numbers = np.zeros(self._size)
        self._speeds = np.zeros(3 if self._size < 7 else 6)
        self._moved: list[PlanarMove] = []

    @property
    def where(self) -> str:
        """The task as a place of errors."""
        return self.task.where

    def connect(self, references: ReferenceFilter, index: int, motion: MotionRecord, tolerances: np.ndarray) -> None:
        """Let the reference follow one of a filter.

        Args:
            references: The filter.
            index: Number of its reference.
            motion: How the reference moves, and how fast an error is corrected beside that.
            tolerances: Error of a task that has arrived [m, rad], shape (2,).
        """
        self._filter = references
        self._index = index
        self._feeds = motion.feed_forward and self._moves
        self.limit(motion)
        self._period = references.period
        self._tolerances = tolerances
        self.take_gain()
        last = self._first + self._size
        self._value = references.value[index, self._first : last]
        self._desired = references.target[index, self._first : last]
        rates = references.rate[index, self._first : self._first + self.task.point.rows]
        self._rate = rates
        self._rows = self.task.selected
        self._error = self.task.error.value
        self._turn = self._error[-3:] if self.quantity != "position" else self._error[:0]
        self._place = self._error[:3] if self.quantity != "orientation" else self._error[:0]
        self._checks = round(CHECK / self._period)
        self._growth = math.exp(CHECK / GROWTH)

    def limit(self, motion: MotionRecord) -> None:
        """Let the reference move as a record says, and errors be corrected no faster, as far as that counts."""
        self._filter.limits[self._index] = motion.limits
        correction = self.task.correction
        correction[:] = self._correction
        if motion.feed_forward:  # without it errors are what moves the point
            is_turn = (self.task.selected + self._first >= 3) | (not self._moves)
            most = np.where(is_turn, motion.turn_speed, motion.speed)
            np.minimum(correction, most, out=correction)

    def correct(self, correction: np.ndarray) -> None:
        """Set the rates by which errors are corrected at most, before `limit`; shape (rows,)."""
        self._correction[:] = correction

    def take_gain(self) -> None:
        """Go on with the gain that the task has."""
        self._gain = float(self.task.gain.max())
        self._step = self._gain * self._period

    def start(self) -> None:
        """Begin where the point is, at rest, and go on to the reference that the task has; a look begins there."""
        self.is_held = False
        whole = np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        desired = self._reference.value.copy()
        value = self.task.point.value if self._moves else desired
        whole[self._first : self._first + self._size] = value
        self._filter.start(self._index, whole)
        if not np.array_equal(desired, value):
            self._filter.aim(self._index, desired, self._first)
        self._stamp = -math.inf
        self._forget()
        self._is_generated = self._generator is not None
        if self._generator is not None:
            self._time = 0.0
            self._moved.clear()
            self._generator.start(value)

    def generate(self, step: float) -> None:
        """Let a generated reference go on by some time [s]; at its end it stays."""
        if not self._is_generated:
            return
        assert self._generator is not None
        self._time += step
        self._generator.at(self._time, self._numbers, self._speeds)
        for move in self._moved:
            self._displace_numbers(move, self._numbers)
        self._is_generated = self._time < self._generator.duration
        self._filter.aim(self._index, self._numbers, self._first, self._is_generated)

    def displace(self, move: PlanarMove) -> None:
        """Move a reference in the world with the base, whose estimate has jumped."""
        if self.frame != WORLD:
            return
        self._filter.displace(self._index, move)
        if self._is_generated:
            self._moved.append(move)
        if self.is_held:
            self._displace_numbers(move, self._reference.value)

    def _displace_numbers(self, move: PlanarMove, numbers: np.ndarray) -> None:
        if self.quantity != "orientation":
            move.move(numbers[:3])
        if self.quantity != "position":
            move.turn_orientation(numbers[-4:])

    def read_port(self) -> str:
        """Take over a reference that the port has received; return what is wrong with it, empty if nothing is."""
        if not self.port.fresh:
            return ""
        outcome = self._filter.aim(self._index, self.port.value, self._first, True)
        if outcome == NOT_FINITE:
            return "a reference that is not finite"
        if outcome == NOT_A_TURN:
            return "a quaternion that has not the length 1"
        self._is_generated = False
        return ""

    def want(self, values: tuple[float, ...] | np.ndarray, relative: bool = False, stream: bool = False) -> None:
        """Set the reference of the task.

        Args:
            values: Position [m], quaternion, or both.
            relative: Whether they are added to the present reference.
            stream: Whether others follow, so that it moves in between.

        Raises:
            SizeMismatch: There are not as many numbers as the task has.
            NotFinite: One is NaN or infinite, or a quaternion has not the length 1; nothing has changed.
        """
        self.check(values)
        numbers = np.array(values, dtype=float)
        if relative:
            numbers = self._added(numbers)
        self._filter.aim(self._index, numbers, self._first, stream)
        self._is_generated = False
        self._forget()

    def check(self, values: tuple[float, ...] | np.ndarray) -> None:
        """Check a reference; see `want`."""
        if len(values) != self._size:
            raise SizeMismatch(
                f"{len(values)} numbers", where=self.where, expected=f"the {self._size} of its {self.quantity}"
            )
        numbers = np.array(values, dtype=float)
        if not np.isfinite(numbers).all():
            raise NotFinite(f"a reference of {numbers.tolist()}", where=self.where)
        if self.quantity != "position" and abs(np.linalg.norm(numbers[-4:]) - 1.0) > 1e-3:
            raise NotFinite(
                f"a reference with the quaternion {numbers[-4:].tolist()}",
                where=self.where,
                expected="a quaternion of length 1",
            )

    def check_header(self, frame: str, stamp: float) -> None:
        """Check frame and time [s] of a message; times are those of one sender.

        Raises:
            UnknownName: It is in another frame than the task's reference.
            ComponentError: It is older than the one before it, or its time is no number.
        """
        if frame not in ("", self.frame):
            raise UnknownName("frame of a reference", frame, (self.frame,), where=self.where)
        if not stamp >= self._stamp and stamp != 0.0:
            raise ComponentError(
                f"a reference of {stamp:g} s after one of {self._stamp:g} s",
                where=self.where,
                expected="times that do not go back",
            )
        self._stamp = max(stamp, self._stamp)

    def part_of(self, pose: tuple[float, ...]) -> tuple[float, ...]:
        """Return what the task has of the seven numbers of a pose."""
        return pose[self._first : self._first + self._size]

    def remaining(self) -> tuple[float, float]:
        """Compute distance [m] and angle [rad] between the point and its reference."""
        if not self._moves:
            return float(self.residual[0]), 0.0
        away = self._reference.space.subtract(self._desired, self.task.point.value)
        place = away[:3] if self.quantity != "orientation" else away[:0]
        turn = away[-3:] if self.quantity != "position" else away[:0]
        return float(np.linalg.norm(place)), float(np.linalg.norm(turn))

    def halt(self) -> None:
        """Let the reference come to rest."""
        self._filter.halt(self._index)
        self._is_generated = False
        self._forget()

    @property
    def reference(self) -> tuple[float, ...]:
        """Where the reference is: position [m], quaternion, or both."""
        return tuple(self._value.tolist())

    @property
    def desired(self) -> tuple[float, ...]:
        """Where the reference is to be: position [m], quaternion, or both."""
        return tuple(self._desired.tolist())

    def prepare(self, pace: float) -> None:
        """Write the reference of the next cycle, and its velocity at a pace; called after the filter's update."""
        if self.is_held:
            return
        if self._feeds:
            np.take(self._rate, self._rows, out=self._fed, mode="clip")
            np.multiply(self._fed, pace, out=self._fed)
            np.add(self._fed, self._own_velocity, out=self._velocity)
        else:
            self._reference.value[:] = self._value

    def refer(self) -> None:
        """Write the reference where its velocity starts, before the filter is updated."""
        if self._feeds and not self.is_held:
            self._reference.value[:] = self._value

    def hold(self) -> None:
        """Follow the place where the point is now, until `let_go`; the distance stays what it is. Called in each cycle.

        What is known of the point is a cycle old: it would go back for that. So its place is taken over again at first.
        """
        self.is_held = True
        if self._takeovers:
            self._takeovers -= 1
            self._reference.value[:] = self.task.point.value

    def let_go(self) -> None:
        """Follow the reference again."""
        if self.is_held:
            self.is_held = False
            self._reference.value[:] = self._value
            self._forget_progress()

    @property
    def is_generated(self) -> bool:
        """Whether it follows the reference that the configuration generates."""
        return self._is_generated

    @property
    def distance(self) -> float:
        """How far the task is from its reference, of a pose the sum of distance [m] and angle [rad]."""
        return float(self.residual[0] + self.residual[1])

    @property
    def is_still(self) -> bool:
        """Whether the reference has arrived, at rest."""
        return self._filter.is_still(self._index)

    def measure(self) -> float:
        """Compute how far the point is from its reference; return the way that a cycle's step wants to go, K |e| T."""
        if not self.is_held:
            place = self._place
            turn = self._turn
            self.residual[0] = math.sqrt(float(place.dot(place))) if len(place) else 0.0
            self.residual[1] = math.sqrt(float(turn.dot(turn))) if len(turn) else 0.0
        return self._step * math.hypot(self.residual[0], self.residual[1])

    def has_arrived(self) -> bool:
        """Return whether the point is at its reference."""
        return self._filter.is_still(self._index) and not (self.residual > self._tolerances).any()

    def watch(self) -> None:
        """Look whether the task still comes nearer to its reference; see `stays`."""
        if not self._filter.is_still(self._index):
            self._forget_progress()
            return
        self._cycles += 1
        if self._cycles < self._checks:
            return
        self._cycles = 0
        distance = self.distance
        is_creeping = abs(distance - self._last) < self._creep * self._gain * distance * CHECK
        self._creep = min(self._creep * self._growth, 1.0)
        self._looks = self._looks + 1 if is_creeping else 0
        self._last = distance
        self.stays = self._looks >= CHECKS

    def refresh(self) -> None:
        """Look again whether the task comes nearer to its reference; one that is held is held where it is now."""
        self._last = math.inf
        self._cycles = 0
        self._looks = 0
        self._takeovers = TAKEOVERS
        self.stays = False

    def judge(self) -> str:
        """Note whether it has come to rest away from its reference; return what to say about it, once."""
        self.is_unreachable = bool((self.residual > self._tolerances).any())
        if not self.is_unreachable or self._was_received:
            return ""
        self._was_received = True
        far = [f"{self.residual[0]:.4g} m"] if len(self._place) else []
        return " and ".join(far + ([f"{self.residual[1]:.4g} rad"] if len(self._turn) else []))

    def _forget(self) -> None:
        """Forget how far the task has come with another reference."""
        self._forget_progress()
        self._was_received = False

    def _forget_progress(self) -> None:
        self.refresh()
        self.is_unreachable = False
        self._creep = CREEP

    def _added(self, numbers: np.ndarray) -> np.ndarray:
        """Add numbers to the reference; quaternions turn it in the same axes."""
        result = self._desired + numbers
        if self.quantity != "position":
            result[-4:] = quaternion_product(numbers[-4:], self._desired[-4:])
        return result


def quantity_of(reference: Constant) -> str:
    """Return the quantity of a reference."""
    if reference.space == ORIENTATION:
        return "orientation"
    return "pose" if reference.space == POSE else "position"
