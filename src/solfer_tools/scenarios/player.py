"""Plays scenarios: velocities of base and vertices at any period, and how much is left."""

import numpy as np

from solfer.errors import ConfigError, SolferError
from solfer_tools.scenarios.scenario import Scenario
from solfer_tools.scenarios.script import Script
from solfer_tools.scenarios.steps import played


class Player:
    """Plays a scenario, open loop: what it gives never depends on the robot.

    At the file's own period it does what the original's script does. At any other one it gives means of the
    script's velocities, so that what integrates them goes the same way.

    Args:
        scenario: The scenario.
        period: Time between two steps [s]; None: the file's own.

    Attributes:
        scenario: The scenario.
        period: Time between two steps [s].
        vertex_velocity: Velocities of the vertices in the axes of the base's heading, relative to the base,
            shape (n, 3) [m/s].
        base_velocity: Velocities of x, y, z and heading of the base in the file's frame, with the constant velocity,
            shape (4,) [m/s, rad/s].
        elapsed: Time that was played [s].
    """

    def __init__(self, scenario: Scenario, period: float | None = None):
        self.scenario = scenario
        self.period = scenario.period if period is None else period
        if not 0.0 < self.period < np.inf:
            raise SolferError(f"a period of {period}", expected="a positive number of seconds")
        self._script = Script(scenario)
        self._steps = played(scenario)
        self._constant = scenario.constant
        self._numbers = len(self._steps)
        self.vertex_velocity = np.zeros((scenario.legs, 3))
        self.base_velocity = np.zeros(4)
        self._vertex_part = np.zeros((scenario.legs, 3))
        self._base_part = np.zeros(4)
        self._index = -1
        self._rest = 0.0
        self.elapsed = 0.0
        self._is_over = False

    @property
    def camber(self) -> np.ndarray:
        """Camber of each leg, shape (n,) [rad]; live."""
        return self._script.camber

    @property
    def grounded(self) -> np.ndarray:
        """Which legs have contact with the ground, shape (n,); live."""
        return self._script.grounded

    @property
    def vertices(self) -> np.ndarray:
        """Vertices of the file at the end of its newest period, shape (n, 3) [m]; live."""
        return self._script.vertices

    @property
    def base(self) -> np.ndarray:
        """Base of the file then, without the constant velocity, shape (4,) [m, rad]; live."""
        return self._script.base

    @property
    def number(self) -> int:
        """Number of the step in the pattern, from 1; 0 before the first."""
        return min(self._index + 1, self._numbers)

    @property
    def verb(self) -> str:
        """Verb of that step; empty before the first."""
        return self.scenario.pattern[self.number - 1].type if self.number else ""

    @property
    def left(self) -> float:
        """Time that is left [s]."""
        return 0.0 if self._is_over else max(0.0, self.scenario.duration - self.elapsed)

    @property
    def is_over(self) -> bool:
        """Whether all has been played, and all velocities are zero."""
        return self._is_over

    def step(self, period: float | None = None) -> bool:
        """Compute the velocities of the next period; False with velocities of zero when all is over.

        Args:
            period: Another time than `self.period` by which to go on [s], above zero: what plays a scenario slower
                than it is goes on by a fraction of its own period, and multiplies the velocities by that fraction.
        """
        period = self.period if period is None else period
        vertices = self.vertex_velocity
        base = self.base_velocity
        left = period
        rounding = 1e-9  # of a period
        vertices[:] = 0.0
        base[:] = 0.0
        while left > rounding * period:
            if self._rest <= rounding * self._script.period:
                if not self._go_on():
                    break
                self._rest = self._script.period
            span = min(left, self._rest)
            np.multiply(self._script.vertex_velocity, span / period, out=self._vertex_part)
            np.add(self._script.base_velocity, self._constant, out=self._base_part)
            np.multiply(self._base_part, span / period, out=self._base_part)
            np.add(vertices, self._vertex_part, out=vertices)
            np.add(base, self._base_part, out=base)
            left = left - span
            self._rest = self._rest - span
        self.elapsed += period - max(0.0, left)
        self._is_over = left >= period
        return not self._is_over

    def _go_on(self) -> bool:
        """Let the script make a step of its own; False at its end."""
        script = self._script
        steps = self._steps
        while self._index < 0 or (self._index < self._numbers and steps[self._index].done(script)):
            self._index += 1
            if self._index < self._numbers:
                steps[self._index].start(script)
        if self._index >= self._numbers:
            script.rest()
            return False
        steps[self._index].step(script)
        script.move()
        return True


def count_periods(scenario: Scenario) -> tuple[int, ...]:
    """Play a pattern, and count the periods of each step.

    Raises:
        ConfigError: A step never ends.
    """
    script = Script(scenario)
    limit = 1_000_000  # periods that a step may take
    counts = []
    for number, (record, step) in enumerate(zip(scenario.pattern, played(scenario), strict=True), 1):
        step.start(script)
        most = step.longest(script)
        count = 0
        while not step.done(script):
            if count > most or most > limit:
                raise ConfigError(
                    f"step {number} of the pattern, '{record.type}', "
                    + ("never ends" if count > most or most == np.inf else f"takes more than {limit} periods"),
                    where=record.where(),
                    expected="speeds with which its goals can be reached, and met to 5 mm and 5 mrad",
                )
            step.step(script)
            script.move()
            count += 1
        counts.append(count)
    return tuple(counts)
