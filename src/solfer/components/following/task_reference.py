"""A task with the reference that others give it."""

import math

import numpy as np

from solfer.components.following.filtered import FeedForward, FilteredReference, HeldPlace
from solfer.components.following.generated import GeneratedReference
from solfer.components.following.progress import Residual, TaskProgress
from solfer.components.following.quantity import PoseNumbers
from solfer.components.following.tags import MotionRecord
from solfer.errors import UnknownName
from solfer.interfaces.geometry import bare_frame
from solfer.interfaces.port import Port
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import FURTHEST_TARGET, NOT_A_ROTATION, NOT_FINITE, ReferenceFilter
from solfer.points import Constant, LookAt
from solfer.references import ReferenceGenerator
from solfer.tasks import Task

WORLD = "world"


class TaskReference:
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
        port: Receives references.
        reason: Why it came to rest away from its reference, the last time.
        generated: Reference that the configuration generates; None: it has none.
        progress: Whether it still comes nearer to its reference; from `connect` on.
    """

    def __init__(
        self, name: str, task: Task, reference: Constant, frame: str, generator: ReferenceGenerator | None = None
    ):
        self.name = name
        self.task = task
        self.frame = frame
        self.reason = ""
        self._reference = reference
        self._numbers = PoseNumbers.of(reference)
        self.port = Port(self.quantity)
        self._correction = task.correction.copy()
        self._feed_forward = FeedForward(task)
        self._held = HeldPlace(task, reference)
        self.generated = None if generator is None else GeneratedReference(generator, self._numbers)
        self._filtered: FilteredReference
        self._residual: Residual
        self.progress: TaskProgress
        self._period: float

    @property
    def where(self) -> str:
        """The task as a place of errors."""
        return self.task.where

    @property
    def quantity(self) -> str:
        """'position', 'orientation' or 'pose'."""
        return self._numbers.quantity

    @property
    def residual(self) -> np.ndarray:
        """Distance of point and reference as of the last cycle [m], and their angle [rad], shape (2,); live."""
        return self._residual.values

    @property
    def stays(self) -> bool:
        """Whether the point's distance from a reference at rest does not change any more."""
        return self.progress.stays

    @property
    def is_unreachable(self) -> bool:
        """Whether the task has come to rest away from its reference."""
        return self.progress.is_unreachable

    @property
    def is_held(self) -> bool:
        """Whether it follows the place where it came to rest instead."""
        return self._held.is_held

    @property
    def _moves(self) -> bool:
        """Whether its point is what moves to the reference: a look does not."""
        return not isinstance(self.task.point, LookAt)

    def connect(
        self,
        references: ReferenceFilter,
        index: int,
        motion: MotionRecord,
        tolerances: np.ndarray,
        residual: np.ndarray,
    ) -> None:
        """Let the reference follow one of a filter.

        Args:
            references: The filter.
            index: Number of its reference.
            motion: How the reference moves, and how fast an error is corrected beside that.
            tolerances: Error of a task that has arrived [m, rad], shape (2,).
            residual: Where distance of point and reference are written [m], and their angle [rad], shape (2,).
        """
        self._filtered = FilteredReference(references, index, self._numbers)
        self._feed_forward.connect(self._filtered.rate, motion.feed_forward and self._moves)
        self.limit(motion)
        self._residual = Residual(self.task.error.value, self._numbers, tolerances, values=residual)
        self.progress = TaskProgress(float(self.task.gain.max()))
        self._period = references.period

    def limit(self, motion: MotionRecord) -> None:
        """Let the reference move by the limits of a record, and errors be corrected no faster."""
        self._filtered.limits[:] = motion.limits
        correction = self.task.correction
        correction[:] = self._correction
        if motion.feed_forward:  # without it errors are what moves the point
            is_turn = (self.task.selected + self._numbers.first >= 3) | (not self._moves)
            most = np.where(is_turn, motion.turn_speed, motion.speed)
            np.minimum(correction, most, out=correction)

    def correct(self, correction: np.ndarray) -> None:
        """Set the rates by which errors are corrected at most, before `limit`; shape (rows,)."""
        self._correction[:] = correction

    def take_gain(self) -> None:
        """Go on with the gain that the task has."""
        self.progress.gain = float(self.task.gain.max())

    def start(self) -> None:
        """Begin where the point is, at rest, and go on to the reference that the task has; a look begins there."""
        self._held.is_held = False
        desired = self._reference.value.copy()
        value = self.task.point.value if self._moves else desired
        self._filtered.start(value)
        if not np.array_equal(desired, value):
            self._filtered.aim(desired)
        self._forget()
        if self.generated is not None:
            self.generated.start(value)

    def generate(self, step: float) -> None:
        """Let a generated reference go on by some time [s]; at its end it stays."""
        generated = self.generated
        if generated.is_running:
            generated.advance(step)
            self._filtered.aim(generated.value, generated.is_running)

    def displace(self, move: PlanarMove) -> None:
        """Move a reference in the world with the base, whose estimate has jumped."""
        if self.frame != WORLD:
            return
        self._filtered.displace(move)
        if self.generated is not None:
            self.generated.displace(move)
        if self.is_held:
            self._numbers.displace(move, self._reference.value)

    def read_port(self) -> str:
        """Take over a reference that the port has received; return what is wrong with it, empty if nothing is."""
        if not self.port.fresh:
            return ""
        outcome = self._filtered.aim(self.port.value, True)
        if outcome == NOT_FINITE:
            return f"a reference that is not finite, or beyond {FURTHEST_TARGET:g} m"
        if outcome == NOT_A_ROTATION:
            return "a quaternion that has not the length 1"
        self._end_generated()
        return ""

    def request(self, values: tuple[float, ...] | np.ndarray, relative: bool = False, stream: bool = False) -> None:
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
            numbers = self._numbers.add(self._filtered.desired, numbers)
            self.check(numbers)
        self._filtered.aim(numbers, stream)
        self._end_generated()
        self._forget()

    def check(self, values: tuple[float, ...] | np.ndarray) -> None:
        """Check a reference; see `request`."""
        self._numbers.check(values, self.where)

    def check_frame(self, frame: str) -> None:
        """Check the frame of a message.

        Raises:
            UnknownName: It is another one than that of the task's reference.
        """
        frame = bare_frame(frame)
        if frame not in ("", self.frame):
            raise UnknownName("frame of a reference", frame, (self.frame,), where=self.where)

    def part_of(self, pose: tuple[float, ...]) -> tuple[float, ...]:
        """Return what the task has of the seven numbers of a pose."""
        return pose[self._numbers.all]

    def remaining(self) -> tuple[float, float]:
        """Compute distance [m] and angle [rad] between the point and its reference."""
        if not self._moves:
            return float(self._residual.values[0]), 0.0
        away = self._reference.space.subtract(self._filtered.desired, self.task.point.value)
        return float(np.linalg.norm(away[self._numbers.place])), float(np.linalg.norm(away[self._numbers.turn]))

    def halt(self) -> None:
        """Let the reference come to rest."""
        self._filtered.halt()
        self._end_generated()
        self._forget()

    @property
    def reference(self) -> tuple[float, ...]:
        """Where the reference is: position [m], quaternion, or both."""
        return tuple(self._filtered.value.tolist())

    @property
    def desired(self) -> tuple[float, ...]:
        """Where the reference is to be: position [m], quaternion, or both."""
        return tuple(self._filtered.desired.tolist())

    def prepare(self, pace: float) -> None:
        """Write the reference of the next cycle, and its velocity at a pace; called after the filter's update."""
        if self._held.is_held:
            return
        if self._feed_forward.is_used:
            self._feed_forward.write(pace)
        else:
            self._reference.value[:] = self._filtered.value

    def refer(self) -> None:
        """Write the reference where its velocity starts, before the filter is updated."""
        if self._feed_forward.is_used and not self._held.is_held:
            self._reference.value[:] = self._filtered.value

    def hold(self) -> None:
        """Follow the place where the point is now, until `follow`; the distance stays what it is. See `HeldPlace`."""
        self._held.hold()

    def follow(self) -> None:
        """Follow the reference again."""
        if self._held.is_held:
            self._held.is_held = False
            self._reference.value[:] = self._filtered.value
            self._restart_progress()

    @property
    def is_generated(self) -> bool:
        """Whether it follows the reference that the configuration generates."""
        return self.generated is not None and self.generated.is_running

    @property
    def distance(self) -> float:
        """How far the task is from its reference, of a pose the sum of distance [m] and angle [rad]."""
        return float(self._residual.values[0] + self._residual.values[1])

    @property
    def is_still(self) -> bool:
        """Whether the reference has arrived, at rest."""
        return self._filtered.is_still

    def measure(self) -> float:
        """Compute how far the point is from its reference; return the displacement that a step requests, K |e| T."""
        residual = self._residual
        if not self._held.is_held:
            residual.measure()
        return self.progress.gain * self._period * math.hypot(residual.values[0], residual.values[1])

    def has_arrived(self) -> bool:
        """Return whether the point is at its reference."""
        return self._filtered.is_still and not self._residual.is_beyond()

    def watch(self) -> bool:
        """Look whether the task still comes nearer to its reference, see `stays`; return whether that is at rest.

        Called every 20 ms.
        """
        is_still = self._filtered.is_still
        if is_still:
            self.progress.look(self.distance)
        else:
            self._restart_progress()
        return is_still

    def refresh(self) -> None:
        """Look again whether the task comes nearer to its reference; one that is held is held where it is now."""
        self.progress.look_again()
        self._held.take_again()

    def come_to_rest(self) -> str:
        """Note whether it has come to rest away from its reference; return a report of that, once."""
        return str(self._residual) if self.progress.come_to_rest(self._residual.is_beyond()) else ""

    def _end_generated(self) -> None:
        if self.generated is not None:
            self.generated.is_running = False

    def _forget(self) -> None:
        """Forget how far the task has come with another reference."""
        self.progress.forget()
        self._held.take_again()

    def _restart_progress(self) -> None:
        self.progress.restart()
        self._held.take_again()
