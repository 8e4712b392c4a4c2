"""The steps of a pattern as they are played: nothing is looked up once they are made."""

import abc
import functools
import math

import numpy as np

from solfer_tools.scenarios.records import (
    BASE_ROW,
    CircleRecord,
    LegClaimRecord,
    LegReleaseRecord,
    MoveRecord,
    SpeedRecord,
    Step,
    TurnRecord,
    WaitRecord,
)
from solfer_tools.scenarios.scenario import Scenario
from solfer_tools.scenarios.script import HEADING_INDEX, LAST_STEP, LOWEST_SPEED, Script


class PlayedStep(abc.ABC):
    """A step of a pattern, as it is played."""

    def start(self, script: Script) -> None:  # noqa: B027 most have nothing to do
        """Begin; the script has the numbers that the step before has left."""

    @abc.abstractmethod
    def done(self, script: Script) -> bool:
        """Return whether it is at its end."""

    @abc.abstractmethod
    def step(self, script: Script) -> None:
        """Write the velocities of the next period."""

    @abc.abstractmethod
    def longest(self, script: Script) -> float:
        """Return how many periods it takes at most if it ends at all, as the script is now; infinity: never."""


class _Instant(PlayedStep):
    """A step that takes no time."""

    def done(self, _: Script) -> bool:
        return True

    def step(self, _: Script) -> None:
        """Do nothing."""

    def longest(self, _: Script) -> float:
        return 0.0


class _Speed(_Instant):
    def __init__(self, record: SpeedRecord):
        self._motions = record.motions

    def start(self, script: Script) -> None:
        for row, column, value in self._motions:
            if row == BASE_ROW:
                script.base_speed[column] = value
            else:
                script.vertex_speed[column, row] = value


class _Contact(_Instant):
    def __init__(self, leg: int, grounded: bool):
        self._leg = leg
        self._grounded = grounded

    def start(self, script: Script) -> None:
        script.grounded[self._leg] = self._grounded


class _Wait(PlayedStep):
    def __init__(self, periods: int):
        self._periods = periods
        self._left = 0

    def start(self, _: Script) -> None:
        self._left = self._periods

    def done(self, _: Script) -> bool:
        return self._left <= 0

    def step(self, script: Script) -> None:
        self._left -= 1
        script.rest()

    def longest(self, _: Script) -> float:
        return self._periods


class _Move(PlayedStep):
    def __init__(self, vertices: np.ndarray, base: np.ndarray, camber: np.ndarray | None):
        self._vertices = vertices
        self._base = base
        self._camber = camber
        tolerance = 5e-3  # absolute [m, rad], or as a fraction of the goal
        self._near = tolerance * np.maximum(1.0, np.abs(vertices))
        self._base_near = tolerance * np.maximum(1.0, np.abs(base))
        self._left = np.zeros_like(vertices)
        self._base_left = np.zeros_like(base)
        self._fits = np.zeros(vertices.shape, dtype=bool)
        self._base_fits = np.zeros(base.shape, dtype=bool)

    def start(self, script: Script) -> None:
        if self._camber is not None:
            script.camber[:] = self._camber

    def done(self, script: Script) -> bool:
        np.subtract(script.base, self._base, out=self._base_left)
        np.abs(self._base_left, out=self._base_left)
        np.less_equal(self._base_left, self._base_near, out=self._base_fits)
        if not self._base_fits.all():
            return False
        np.subtract(script.vertices, self._vertices, out=self._left)
        np.abs(self._left, out=self._left)
        np.less_equal(self._left, self._near, out=self._fits)
        return bool(self._fits.all())

    def step(self, script: Script) -> None:
        script.approach(self._vertices)
        script.go(self._base)

    def longest(self, script: Script) -> float:
        far = np.abs(self._base - script.base)
        distances = np.where(far <= self._base_near, 0.0, far).tolist()
        speeds = script.base_speed.tolist()
        base = max(
            _straight(distance, speed * script.period) for distance, speed in zip(distances, speeds, strict=True)
        )
        left = np.abs(self._vertices - script.vertices).ravel().tolist()
        ratios = script.vertex_speed.ravel().tolist()
        return max(base, *(_exponential(*each, script.period) for each in zip(left, ratios, strict=True)))


class _Heading(PlayedStep):
    """A step that ends at a heading, while the vertices approach their goals."""

    def __init__(self, vertices: np.ndarray, heading: float):
        self._vertices = vertices
        self._heading = heading

    def done(self, script: Script) -> bool:
        return abs(self._heading - float(script.base[HEADING_INDEX])) <= 1e-2  # [rad]

    def longest(self, script: Script) -> float:
        left = abs(self._heading - float(script.base[HEADING_INDEX]))
        return _straight(left, float(script.base_speed[HEADING_INDEX]) * script.period)


class _Turn(_Heading):
    def __init__(self, vertices: np.ndarray, record: TurnRecord):
        super().__init__(vertices, record.radius)
        self._speed = record.angle

    def step(self, script: Script) -> None:
        script.approach(self._vertices)
        script.turn(self._heading)
        heading = float(script.base[HEADING_INDEX])
        script.base_velocity[0] = self._speed * math.cos(heading)
        script.base_velocity[1] = self._speed * math.sin(heading)


class _Circle(_Heading):
    def __init__(self, vertices: np.ndarray, record: CircleRecord):
        super().__init__(vertices, record.angle)
        self._along = record.x_sign * record.radius, record.y_sign * record.radius

    def step(self, script: Script) -> None:
        script.approach(self._vertices)
        rate = script.turn(self._heading)
        heading = float(script.base[HEADING_INDEX])
        script.base_velocity[0] = self._along[0] * rate * math.cos(heading)
        script.base_velocity[1] = self._along[1] * rate * math.sin(heading)


def _straight(left: float, step: float) -> float:
    """Return after how many steps of a length a path is gone, or passed to and fro for ever."""
    if left <= LAST_STEP:
        return 1.0
    return left / step + 2.0 if step > 0.0 else math.inf


def _exponential(left: float, ratio: float, period: float) -> float:
    """Return after how many periods a vertex that goes a ratio of what is left in each has arrived."""
    if ratio * left < LOWEST_SPEED * period or ratio >= 1.0:
        return 2.0
    return math.log(LOWEST_SPEED * period / (ratio * left)) / math.log1p(-ratio) + 3.0


def played(scenario: Scenario) -> tuple[PlayedStep, ...]:
    """Make the steps of a scenario's pattern."""
    return tuple(_played(step, scenario) for step in scenario.pattern)


@functools.singledispatch
def _played(record: Step, scenario: Scenario) -> PlayedStep:
    raise TypeError(f"nothing plays a step of the kind {type(record).__name__}")


@_played.register
def _(record: MoveRecord, scenario: Scenario) -> PlayedStep:
    tables = scenario.record
    camber = None
    if record.cs is not None and tables.cs_ref is not None:
        camber = np.array(tables.cs_ref[record.cs])
    return _Move(scenario.goals(record), np.array(tables.base_ref[record.base]), camber)


@_played.register
def _(record: TurnRecord, scenario: Scenario) -> PlayedStep:
    return _Turn(scenario.goals(record), record)


@_played.register
def _(record: CircleRecord, scenario: Scenario) -> PlayedStep:
    return _Circle(scenario.goals(record), record)


@_played.register
def _(record: WaitRecord, _: Scenario) -> PlayedStep:
    return _Wait(record.steps)


@_played.register
def _(record: LegClaimRecord, _: Scenario) -> PlayedStep:
    return _Contact(record.leg, grounded=False)


@_played.register
def _(record: LegReleaseRecord, _: Scenario) -> PlayedStep:
    return _Contact(record.leg, grounded=True)


@_played.register
def _(record: SpeedRecord, _: Scenario) -> PlayedStep:
    return _Speed(record)
