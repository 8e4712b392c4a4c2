"""Blends commands in at a start: from where the joints are, at a part of the robot's speed."""

import logging
import math
from collections.abc import Sequence

import numpy as np

from solfer.pipes import JointCommandPipe
from solfer.pipes.state_field import interface_of
from solfer.robot import Robot

logger = logging.getLogger(__name__)

SHORTEST = 0.5
"""Default of the shortest time of blending in [s]."""


class StartBlend:
    """Blends commands from the measured state to those of the component.

    With u = t / T, the share of the component's command is s(u) = 10 u^3 - 15 u^4 + 6 u^5, the minimum-jerk profile
    (T. Flash and N. Hogan, Journal of Neuroscience 5(7), 1985); the rest is the position at the start, without
    velocity. The blended command is always between the two, however the component's command moves meanwhile.

    The rest has no effort, either, unless the component commands efforts and they are measured: then it begins with the
    measured ones, so that what carries the robot passes from springs to efforts without a sag. Stiffness and damping
    begin where the lower level has them without a command.

    T follows from the first commands. Where they are the positions at the start, without velocity and effort, it is
    zero: nothing is changed. Else it is the longest time that a joint needs for its way at a fifth of its speed
    limit.

    Args:
        owner: Name of the plugin, for messages.
        pipes: The pipes to the lower level.
        robot: The Robot, with the measured State and the limits.
        rate: Cycles a second [Hz].
        shortest: Shortest T where it is not zero [s].
        measured: Whether each DoF's position is measured, shape (robot.size,); others are not blended. None: all are.
        efforts: Whether each DoF's effort is measured, shape (robot.size,); None: none is.

    Attributes:
        shortest: See above.
        active: Whether the start is not over yet.
    """

    def __init__(
        self,
        owner: str,
        pipes: Sequence[JointCommandPipe],
        robot: Robot,
        rate: float,
        shortest: float = SHORTEST,
        *,
        measured: np.ndarray | None = None,
        efforts: np.ndarray | None = None,
    ):
        self._owner = owner
        self._rate = rate
        self.shortest = shortest
        known = {"position": measured, "effort": np.zeros(robot.size, dtype=bool) if efforts is None else efforts}
        self._position = robot.state.position
        kinds = {"position": _Positions, "velocity": _Field, "effort": _Efforts}
        self._fields = [
            kinds.get(field, _Gains)(field, values, pipe, robot, known.get(field))
            for pipe in pipes
            for field, values in pipe.fields
        ]
        self._cycles = self._left = 0
        self._is_planned = True
        self.active = False

    def start(self, position: np.ndarray) -> None:
        """Start again at the next `step`, with joints at `position`, shape (robot.size,) [rad, m]."""
        self._position = position
        self._is_planned = False
        self.active = True

    def step(self) -> None:
        """Blend what the pipes have collected, in place; to be called once a cycle, before sending."""
        if not self._is_planned:
            self._plan()
        if self._left > 0:
            u = 1.0 - self._left / self._cycles
            share = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
            for field in self._fields:
                field.blend(share)
            self._left -= 1
        self.active = self._left > 0

    def _plan(self) -> None:
        """Set where blending begins, and its duration."""
        for field in self._fields:
            field.begin(self._position)
        away = any(field.gap.any() for field in self._fields)
        duration = max(self.shortest, *(field.time() for field in self._fields)) if away else 0.0
        self._cycles = self._left = math.ceil(duration * self._rate)
        self._is_planned = True
        if away:
            logger.info("%s: commands blend in over %.2f s from where the joints are", self._owner, duration)


class _Field:
    """One field of a pipe, which begins at zero.

    Args:
        name: Name of the field.
        values: Values that the pipe is about to send, written in place.
        pipe: The pipe.
        robot: The Robot.
        known: Whether the field of each DoF is measured, shape (robot.size,); None: all are.

    Attributes:
        gap: Difference between the first command and where blending begins, shape (n,).
    """

    def __init__(self, name: str, values: np.ndarray, pipe: JointCommandPipe, robot: Robot, known: np.ndarray | None):
        self._values = values
        self._dofs = pipe.dofs
        self._start = np.zeros_like(values)
        self.gap = np.zeros_like(values)
        self._unknown = np.zeros(len(pipe.dofs), dtype=bool) if known is None else ~known[pipe.dofs]

    def begin(self, position: np.ndarray) -> None:
        """Set where blending begins, with joints at `position`, shape (robot.size,) [rad, m]."""
        np.subtract(self._values, self._start, out=self.gap)

    def time(self) -> float:
        """Compute the duration of the blend [s]; only positions need time of their own."""
        return 0.0

    def blend(self, share: float) -> None:
        """Blend a `share` of the command with the rest of where blending began."""
        values = self._values
        values -= self._start
        values *= share
        values += self._start


class _Limited(_Field):
    """A field that begins within its limits."""

    def __init__(self, name: str, values: np.ndarray, pipe: JointCommandPipe, robot: Robot, known: np.ndarray | None):
        super().__init__(name, values, pipe, robot=robot, known=known)
        dofs = pipe.dofs
        interface = interface_of(name)
        self._lower = robot.lower_limits[interface][dofs]
        self._upper = robot.upper_limits[interface][dofs]

    def _begin_at(self, state: np.ndarray) -> None:
        np.take(state, self._dofs, out=self._start, mode="clip")
        np.clip(self._start, self._lower, self._upper, out=self._start)


class _Positions(_Limited):
    """Positions; one that is not measured begins as it is commanded."""

    def __init__(self, name: str, values: np.ndarray, pipe: JointCommandPipe, robot: Robot, known: np.ndarray | None):
        super().__init__(name, values, pipe, robot=robot, known=known)
        speed = 0.2 * robot.upper_limits.velocity[pipe.dofs]
        peak = 15.0 / 8.0  # largest speed of the minimum-jerk profile, in distances per duration
        self._pace = np.divide(peak, speed, out=np.zeros(len(speed)), where=speed > 0.0)

    def begin(self, position: np.ndarray) -> None:
        """See `_Field.begin`."""
        self._begin_at(position)
        np.copyto(self._start, self._values, where=self._unknown)
        super().begin(position)

    def time(self) -> float:
        """See `_Field.time`; a joint without a speed limit needs no time."""
        return float((np.abs(self.gap) * self._pace).max(initial=0.0))


class _Efforts(_Limited):
    """Efforts, which take over what springs carry; zero where none is commanded, or they are not measured."""

    def __init__(self, name: str, values: np.ndarray, pipe: JointCommandPipe, robot: Robot, known: np.ndarray | None):
        super().__init__(name, values, pipe, robot=robot, known=known)
        self._measured = robot.state[interface_of(name)]

    def begin(self, position: np.ndarray) -> None:
        """See `_Field.begin`."""
        if self._values.any():
            self._begin_at(self._measured)
            np.copyto(self._start, 0.0, where=self._unknown)
        else:
            self._start.fill(0.0)
        super().begin(position)


class _Gains(_Field):
    """Stiffness or damping, which begin where the lower level has them without a command."""

    def __init__(self, name: str, values: np.ndarray, pipe: JointCommandPipe, robot: Robot, known: np.ndarray | None):
        super().__init__(name, values, pipe, robot=robot, known=known)
        self._standing = pipe.standing.get(name, self._values)

    def begin(self, position: np.ndarray) -> None:
        """See `_Field.begin`."""
        np.copyto(self._start, self._standing)
        super().begin(position)
