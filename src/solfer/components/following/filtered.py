"""What a task follows in a cycle: one reference of a filter, its velocity, or the place where it has come to rest."""

from collections.abc import Callable
from functools import partial

import numpy as np

from solfer.components.following.quantity import PoseNumbers
from solfer.numerics.compilation import cached
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import ReferenceFilter
from solfer.points import Constant
from solfer.tasks import Task


class FilteredReference:
    """One reference of a filter.

    Args:
        references: The filter.
        index: Number of its reference.
        numbers: Numbers of a pose that the reference has.

    Attributes:
        value: Where it is: position [m], quaternion, or both; live.
        desired: Where it is to be; live.
        rate: Its velocity, linear [m/s] and angular [rad/s] as far as it has them; live.
        limits: Largest speeds and accelerations, see `ReferenceFilter`; live.
    """

    def __init__(self, references: ReferenceFilter, index: int, numbers: PoseNumbers):
        self._filter = references
        self._index = index
        self._numbers = numbers
        self.value = references.value[index, numbers.all]
        self.desired = references.target[index, numbers.all]
        self.rate = references.rate[index, numbers.first :]
        self.limits = references.limits[index]

    @property
    def is_still(self) -> bool:
        """Whether it has arrived, at rest."""
        return self._filter.is_still(self._index)

    def start(self, value: np.ndarray) -> None:
        """Put it somewhere, at rest."""
        whole = np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        whole[self._numbers.all] = value
        self._filter.start(self._index, whole)

    def aim(self, numbers: np.ndarray, stream: bool = False) -> int:
        """Set where it is to be; see `ReferenceFilter.aim`."""
        return self._filter.aim(self._index, numbers, self._numbers.first, stream)

    def displace(self, move: PlanarMove) -> None:
        """See `ReferenceFilter.displace`."""
        self._filter.displace(self._index, move)

    def halt(self) -> None:
        """See `ReferenceFilter.halt`."""
        self._filter.halt(self._index)


class FeedForward:
    """The velocity of a task: that of its reference beside its own.

    Args:
        task: The task, with its own velocity.

    Attributes:
        is_used: Whether the velocity of the reference counts.
        write: write(pace) writes the velocity of the task, at a pace of its reference; from `connect` on.
    """

    write: Callable[[float], None]

    def __init__(self, task: Task):
        # live; assigning to `task.velocity` would check it
        self._velocity = task.velocity
        self._own = task.velocity.copy()
        self._rows = task.selected
        self.is_used = False

    def connect(self, rate: np.ndarray, is_used: bool) -> None:
        """Let the velocity of the reference be `rate`; live."""
        self.is_used = is_used
        self.write = partial(_feed, rate, self._rows, self._own, self._velocity)


def _feed_forward(rate, rows, own, out, pace):
    """See `FeedForward.write`."""
    for k in range(len(out)):
        out[k] = rate[rows[k]] * pace + own[k]


_feed = cached("void(float64[::1], int64[::1], float64[::1], float64[:], float64)", _feed_forward)


class HeldPlace:
    """The place where a task has come to rest, and stays instead of going on to its reference.

    Args:
        task: The task.
        reference: What it follows.

    Attributes:
        is_held: Whether it follows the place.
    """

    _TAKEOVERS = 5
    """Cycles in which a task takes its place over, until it is at rest there."""

    def __init__(self, task: Task, reference: Constant):
        self._task = task
        self._reference = reference
        self._takeovers = self._TAKEOVERS
        self.is_held = False

    def hold(self) -> None:
        """Follow the place where the point is now; called in each cycle.

        What is known of the point is a cycle old: it would go back for that. So its place is taken over again at first.
        """
        self.is_held = True
        if self._takeovers:
            self._takeovers -= 1
            self._reference.value[:] = self._task.point.value

    def take_again(self) -> None:
        """Take over the place again, if the task is held."""
        self._takeovers = self._TAKEOVERS
