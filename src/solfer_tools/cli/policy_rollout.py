"""A policy on its simulated robot, which shows what names and widths cannot: wrong orders, signs, scales and frames."""

import math
from collections.abc import Iterator, Sequence
from contextlib import closing
from typing import NamedTuple

import numpy as np

from solfer.cli.plugins import generator_of
from solfer.components.policy import Policy
from solfer.config import Configuration
from solfer.errors import ComponentError, SolferError
from solfer.interfaces.geometry import Twist, Vector
from solfer.plugins import Plugin, generate
from solfer.robot.description.shipped import RobotFiles
from solfer_tools.cli.allocations.standing_robot import StandingRobot

PERIOD = 0.02
"""Period of the commands [s]."""

SETTLING, LONGEST_START = 1.0, 10.0  # [s]

COMMANDS = ((0.5, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, 0.8), (0.0, 0.0, -0.8))
"""Commanded velocities: x, y [m/s] and yaw rate [rad/s]; each shows mistakes that others do not show."""

PUSH = 0.1
"""Duration of a push [s]."""

SHARE = 0.6
"""Share of a commanded velocity by which the one that is reached may be wrong."""


TURN = 0.4
"""Yaw rate that may be wrong in any case: many policies turn where they should not [rad/s]."""


class RolloutRow(NamedTuple):
    """A second of a rollout.

    Attributes:
        command: Commanded velocity of the base: x, y [m/s] and yaw rate [rad/s], shape (3,).
        velocity: The mean one, shape (3,).
        distance: Distance of the base from where this command began [m].
        tilt: Largest angle between the vertical and the z axis of the base [rad].
    """

    command: np.ndarray
    velocity: np.ndarray
    distance: float
    tilt: float


def rollout(
    configuration: Configuration,
    given: RobotFiles | None,
    commands: Sequence[Sequence[float]] = COMMANDS,
    *,
    seconds: int = 4,
    push: float = 0.0,
) -> Iterator[RolloutRow]:
    """Simulate a policy with one command after the other, each of which begins from rest; yield each second of them.

    Args:
        configuration: Of its plugin.
        given: Files of the robot; None: those beside the configuration.
        commands: Commanded x, y [m/s] and yaw rates [rad/s].
        seconds: How long each is commanded.
        push: Speed that a push gives the robot in every second second, to its left and to its right in turns [m/s].

    Raises:
        SolferError: The plugin or the robot cannot be made; it holds or falls, or does not reach a velocity.
    """
    where = f"{configuration.file}: {configuration.name}"
    with closing(StandingRobot(configuration, given, where)) as robot:
        if not robot.simulation.floating:
            raise ComponentError("a rollout measures how the base moves", where=where, expected="a floating base")
        with closing(generate(configuration, robot.middleware, generator_of(configuration))) as plugin:
            robot.every(1.0 / plugin.rate, plugin.cycle)
            run = _Rollout(robot, plugin, where=where, push=push)
            run.begin()
            for command in commands:
                yield from run.seconds(np.array(command), seconds)


class _Rollout:
    def __init__(self, robot: StandingRobot, plugin: Plugin, *, where: str, push: float):
        self._robot = robot
        self._plugin = plugin
        self._where = where
        self._momentum = push * robot.simulation.body.robot.mass()
        assert isinstance(plugin.component, Policy)
        self._component = plugin.component
        self._simulation = robot.simulation
        self._base = robot.simulation.body.base_link
        self._height = float(robot.simulation.body.position[2])

    def begin(self) -> None:
        """Wait until the plugin runs."""
        while not self._plugin.running and self._robot.time < LONGEST_START:
            self._robot.run(PERIOD)
        if not self._plugin.running:
            what = f"the plugin does not start: {self._plugin.health()[1]}"
            raise ComponentError(what, where=self._where, expected="a robot that publishes what it needs")

    def seconds(self, command: np.ndarray, count: int) -> Iterator[RolloutRow]:
        """Rest, then yield each second of a command."""
        self._advance(np.zeros(3), SETTLING)
        start = self._simulation.body.position.copy()
        reached = []
        for second in range(count):
            if second % 2 and self._momentum:
                self._push(1.0 if second % 4 == 1 else -1.0)
            velocity, tilt = self._advance(command, 1.0)
            reached.append(velocity)
            distance = float(np.linalg.norm((self._simulation.body.position - start)[:2]))
            yield RolloutRow(command, velocity, distance, tilt=tilt)
        wrong = np.mean(reached[count // 2 :], axis=0) - command
        speed, turn = float(np.hypot(*command[:2])), abs(float(command[2]))
        if speed:
            self._check("velocity", speed, float(np.hypot(*wrong[:2])), bound=SHARE * speed)
        self._check("yaw rate", turn, abs(float(wrong[2])), bound=max(SHARE * turn, TURN))

    def _check(self, kind: str, commanded: float, error: float, *, bound: float) -> None:
        if error > bound:
            what = f"a {kind} of {commanded:g} is commanded, and the one that is reached is wrong by {error:.2f}"
            expected = f"at most {bound:.2g}: is the order of the joints, a sign, a scale or a frame wrong?"
            raise ComponentError(what, where=self._where, expected=expected)

    def _advance(self, command: np.ndarray, duration: float) -> tuple[np.ndarray, float]:
        """Let time pass; return the mean velocity, x and y in axes of the base, shape (3,), and the largest tilt."""
        x, y, turn = command.tolist()
        velocities = []
        tilt = 0.0
        heading = self._heading()
        for _ in range(round(duration / PERIOD)):
            self._component.receive(Twist(Vector(x, y, 0.0), Vector(0.0, 0.0, turn)))
            before = self._simulation.body.position.copy()
            try:
                self._robot.run(PERIOD)
            except SolferError as error:
                raise self._ended(error.what) from error
            moved = (self._simulation.body.position - before) / PERIOD
            last = heading
            heading = self._heading()
            turned = math.remainder(heading - last, 2.0 * math.pi) / PERIOD
            cosine, sine = math.cos(heading), math.sin(heading)
            velocities.append((cosine * moved[0] + sine * moved[1], cosine * moved[1] - sine * moved[0], turned))
            upright = self._simulation.state.now.rotation(self._base)[2, 2]
            tilt = max(tilt, math.acos(max(-1.0, min(1.0, upright))))
            if self._component.fault:
                raise self._ended(self._component.fault)
            if self._simulation.body.position[2] < 0.5 * self._height:
                raise self._ended("the base is at less than half of its height")
        return np.mean(velocities, axis=0), tilt

    def _push(self, side: float) -> None:
        heading = self._heading()
        force = side * self._momentum / PUSH * np.array((-math.sin(heading), math.cos(heading), 0.0))
        self._simulation.pushes.add(self._base, force, np.zeros(3), PUSH)

    def _heading(self) -> float:
        rotation = self._simulation.state.now.rotation(self._base)
        return math.atan2(rotation[1, 0], rotation[0, 0])

    def _ended(self, fault: str) -> ComponentError:
        what = f"the rollout ends {self._robot.time:.1f} s after its begin: {fault}"
        return ComponentError(what, where=self._where, expected="a robot that stays upright")
