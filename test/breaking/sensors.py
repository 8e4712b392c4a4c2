"""Sensors and motors that are wrong: Fig. 5 on the virtual clock, with faults that a seed draws."""

import copy
import logging
import math
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from support.paper.full_control import Nodes

from breaking.sensor_faults import COMMANDS, DRIVES, FAULTS, LASTS, MECHANICAL, PERIOD, SENSORS, WHEELS
from solfer.errors import SolferError
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.transport.messages import FieldsMessage
from solfer_tools.demo.waving import Waving

MOTIONS = {"stands": (0.0, 0.0), "drives": (0.2, 0.0), "turns": (0.1, 0.3)}
"""Velocities of the base, ahead and about z [m/s, rad/s]."""

BEFORE, AFTER, THEN = 2.5, 5.0, 4.0
"""Time before a fault begins, for which it lasts, and for which a trial goes on after a fault that ends [s]."""

OBEYS, NAMED = 0.8, 2.0
"""Share of the commanded velocity from which on a robot drives as commanded, and time within which a fault that moves
it is to be named [s]."""

Change = Callable[[Any, float], None]
"""Changes a message; `time` is that since the fault began [s]."""


@dataclass
class Outcome:
    """What the robot did after a fault.

    Attributes:
        joint: Largest speed of a joint, as a share of its limit.
        base: Largest speed of the base [m/s].
        turn: Largest rate of its heading [rad/s].
        wheel: Largest speed of a wheel [rad/s].
        tilt: Largest tilt [rad].
        rest: Mean speed of the base in the last second [m/s].
        pause: Smallest mean speed of the base over a second [m/s].
        when: When the largest figures were, and `stop` of a plugin, since the fault began [s].
        stopped: Plugins that do not run in the end.
        named: Warnings, with the time since the fault [s], and in the end why plugins were aborted.
        obeys: Whether it drives as commanded in the end.
        advice: What else it says in the end: why a plugin is stopped, or the last warning.
        size: Size of the fault, as drawn.
        findings: What may not be.
    """

    joint: float = 0.0
    base: float = 0.0
    turn: float = 0.0
    wheel: float = 0.0
    tilt: float = 0.0
    rest: float = 0.0
    pause: float = 0.0
    stopped: list[str] = field(default_factory=list)
    when: dict[str, float] = field(default_factory=dict)
    named: list[tuple[float, str]] = field(default_factory=list)
    obeys: bool = False
    advice: str = ""
    size: str = ""
    findings: list[str] = field(default_factory=list)

    @property
    def named_after(self) -> float:
        """Time from the fault to the first warning [s]; infinity: there is none."""
        return self.named[0][0] if self.named else math.inf

    def note(self, name: str, value: float, time: float) -> None:
        """Keep a figure if it is the largest one so far."""
        if value > getattr(self, name):
            setattr(self, name, value)
            self.when[name] = time


class Saying(logging.Handler):
    """Keeps warnings and errors, with their time."""

    def __init__(self, clock: Callable[[], float]):
        super().__init__(logging.WARNING)
        self._clock, self.said = clock, []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append((self._clock(), record.getMessage()))


@contextmanager
def logged(handler: logging.Handler) -> Iterator[None]:
    """Let a handler receive what is logged meanwhile."""
    loggers = [logging.getLogger(package) for package in ("solfer", "solfer_tools")]
    for logger in loggers:
        logger.addHandler(handler)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeHandler(handler)


class DrivenRobot:
    """A robot that is driven and waves.

    Args:
        motion: One of MOTIONS.
        world: The robot.

    Attributes:
        world: See above.
        joints: Its joints.
    """

    def __init__(self, motion: str, world: Nodes):
        self.world = world
        self.joints = list(world.simulation.kinematics.dofs[6:])
        speed, rate = MOTIONS[motion]
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        self._velocity = FieldsMessage({"linear": zero | {"x": speed}, "angular": zero | {"z": rate}})
        self._stick = MemoryMiddleware(world.bus, "stick").writer("locomotion/cmd_vel", "geometry_msgs/Twist")
        world.run(1.5)
        self._waving = Waving(MemoryMiddleware(world.bus, "waving"), "hands", world.hands())
        self._begin = world.bus.time
        self.go(BEFORE)

    def go(self, duration: float) -> None:
        """Command for a while [s]."""
        for _ in range(round(duration / PERIOD)):
            self._stick.write(copy.deepcopy(self._velocity))
            self._waving.send(self.world.bus.time - self._begin)
            self.world.run(PERIOD)


@cache
def driven(motion: str) -> DrivenRobot:
    """Return the robot with which all trials of a motion begin: made once, and continued in copies of this process."""
    return DrivenRobot(motion, Nodes(None))


def in_a_copy(work: Callable[[], Outcome]) -> Outcome:
    """Work in a copy of this process, which stays as it is; return the result, or a finding if there is none."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=lambda: sender.send(work()), daemon=True)
    process.start()
    sender.close()
    try:
        return receiver.recv()
    except EOFError:
        return Outcome(findings=["the trial ended by an exception, see above"])
    finally:
        process.join()
        receiver.close()


class SensorTrial:
    """A robot that is driven and waves, and one fault.

    Args:
        motion: One of MOTIONS.
        fault: Name of a fault, see `FAULTS`; empty: none.
        seed: Seed of what the fault draws.
        amount: Size of the fault; None: it is drawn as well.
        silent: Time after the fault from which no sensor measures anything, so that the robot comes to rest [s].

    Attributes:
        falls: Joints without a motor, whose speeds do not count.
        lasts: How long the fault lasts [s].
    """

    def __init__(self, motion: str, fault: str, seed: int, amount: float | None = None, silent: float = math.inf):
        self.motion, self.fault, self.draw = motion, fault, np.random.default_rng(seed)
        self.seed, self.size, self._amount, self._silent = seed, "", amount, silent
        self.falls: list[int] = []
        self.lasts = math.inf

    def run(self) -> Outcome:
        """Run it."""
        robot = driven(self.motion)
        return in_a_copy(lambda: self._run(robot))

    def begin(self, robot: DrivenRobot) -> None:
        """Let the fault begin."""
        self.world, self.joints = robot.world, robot.joints
        self.begin_of_fault = robot.world.bus.time
        if self.fault:
            (FAULTS | DRIVES)[self.fault](self)

    def _run(self, robot: DrivenRobot) -> Outcome:
        world, outcome, saying = robot.world, Outcome(), Saying(lambda: robot.world.bus.time)
        speeds: list[float] = []
        look = self._looks(robot, outcome)
        world.bus.every(0.002, lambda: speeds.append(look()))
        with logged(saying):
            self.begin(robot)
            duration = AFTER if self.fault and math.isinf(self.lasts) else LASTS + THEN
            silent = min(self._silent, duration)
            robot.go(silent)
            for topic in SENSORS if silent < duration else ():
                world.bus._topics[topic].publish = lambda message, sender, now: None
            robot.go(duration - silent)
        seconds = [float(np.mean(speeds[end - 500 : end])) for end in range(len(speeds), len(speeds) - 2000, -50)]
        outcome.rest = seconds[0]
        outcome.pause = min(seconds)
        outcome.size = self.size
        running = PluginState.RUNNING
        stopped = {name: plugin for name, plugin in world.plugins.items() if plugin.life is not running}
        outcome.stopped = list(stopped)
        outcome.named = [(time - self.begin_of_fault, text) for time, text in saying.said]
        reasons = [managed.reason for managed in world.set.plugins if managed.reason]
        outcome.named += [(outcome.when.get("stop", duration), reason) for reason in reasons]
        outcome.named.sort()
        outcome.obeys = "locomotion" not in stopped and outcome.rest >= OBEYS * MOTIONS[self.motion][0]
        reasons += [f"{name}: {plugin.health()[1]}" for name, plugin in stopped.items()]
        outcome.advice = (reasons or [text for _, text in saying.said[-1:]] or [""])[0]
        return outcome

    def _looks(self, robot: DrivenRobot, outcome: Outcome) -> Callable[[], float]:
        """Return what notes the largest figures, and returns the speed of the base [m/s]."""
        simulation, bus = robot.world.simulation, robot.world.bus
        v, limits = simulation.v, simulation.kinematics.velocity_limit[6:]
        wheels = [index for index, name in enumerate(robot.joints) if WHEELS in name]

        def look() -> float:
            time = bus.time - self.begin_of_fault
            speeds = np.abs(v[6:])
            shares = speeds / limits
            shares[self.falls] = 0.0
            speed = math.hypot(v[0], v[1])
            outcome.note("joint", float(shares.max()), time)
            outcome.note("wheel", float(speeds[wheels].max()), time)
            outcome.note("base", speed, time)
            outcome.note("turn", abs(float(v[5])), time)
            up = float(simulation.state.now.rotation("pelvis")[2, 2])
            outcome.note("tilt", math.acos(min(1.0, max(-1.0, up))), time)
            if any(plugin.life is not PluginState.RUNNING for plugin in robot.world.plugins.values()):
                outcome.when.setdefault("stop", time)
            return speed

        return look

    def joint(self, part: str) -> str:
        """Draw a joint with one of these words in its name."""
        return str(self.draw.choice([name for name in self.joints if any(word in name for word in part.split())]))

    def either(self) -> float:
        """Draw a sign."""
        return float(self.draw.choice((-1.0, 1.0)))

    def amount(self, drawn: float) -> float:
        """Return the size of the fault: that of the trial, or else the one that was drawn."""
        return drawn if self._amount is None else self._amount

    def spoil(self, topic: str, change: Change) -> None:
        """Change the messages of a topic from now on."""
        line = self.world.bus._topics[topic]
        publish = line.publish

        def changed(message: Any, sender: str, now: float) -> None:
            time = now - self.begin_of_fault
            if time < self.lasts:
                change(message, time)  # of the topic alone: a writer sends a copy
            publish(message, sender, now)

        line.publish = changed


SIZES: dict[str, tuple[float, float, str]] = {
    "imu_drift": (0.01, 10.0, "rad/s"),
    "gyro_scale": (1.05, 30.0, ""),
    "gyro_spikes": (1.0, 1e3, "rad/s"),
    "accelerometer_jump": (0.1, 100.0, "m/s^2"),
    "joint_jump": (0.01, 3.0, "rad"),
    "joint_drift": (0.01, 10.0, "rad/s"),
    "joint_scale": (1.01, 10.0, ""),
    "joint_spikes": (0.01, 3.0, "rad"),
}
"""Faults that the feedback pipes name, sizes between which the smallest one lies that they name soon, and units."""

SOON, EARLIER, HALVINGS = 0.5, 1.5, 8
"""Time within which a fault is to be named, and for which pipes get messages before it [s]; how often the interval of
its size is divided."""


class Messages:
    """The messages of the sensors in a motion without a fault, and the pipes that receive them.

    Args:
        motion: One of MOTIONS.
    """

    def __init__(self, motion: str):
        self._motion = motion
        self._world = Nodes(None)
        self._heard: list[tuple[str, Any]] = []
        pipes = {}
        for plugin in self._world.plugins.values():
            for feedback in plugin.feedbacks:
                pipes[feedback.reader.topic] = getattr(feedback, "_pipe", feedback)
        self._pipes = {topic: pipes[topic] for topic in ("imu", "joint_states")}
        for topic in self._pipes:
            self._listen(topic)
        robot = self._robot = DrivenRobot(motion, self._world)
        self._begin = self._world.bus.time
        robot.go(SOON)
        self._heard = [each for each in self._heard if each[1].stamp > self._begin - EARLIER]
        for pipe in self._pipes.values():
            pipe.reader = SimpleNamespace(arrival=0.0)

    def close(self) -> None:
        """End the simulation."""
        self._world.close()

    def smallest(self, fault: str, seed: int) -> tuple[float, float, str]:
        """Find the smallest size that is named soon; return it, a smaller one that is not, and the reason.

        Where the largest one is not named, the size is infinite.
        """
        below, named, _ = SIZES[fault]
        reason = self._named(fault, seed, named)
        if not reason:
            return math.inf, named, "not named"
        for _ in range(HALVINGS):
            middle = math.sqrt(below * named)
            text = self._named(fault, seed, middle)
            below, named, reason = (below, middle, text) if text else (middle, named, reason)
        return named, below, reason

    def _listen(self, topic: str) -> None:
        line = self._world.bus._topics[topic]
        publish = line.publish

        def published(message: Any, sender: str, now: float) -> None:
            self._heard.append((topic, copy.deepcopy(message)))
            publish(message, sender, now)

        line.publish = published

    def _named(self, fault: str, seed: int, amount: float) -> str:
        """Return why a message is refused soon after a fault began; empty: none is."""
        trial = SensorTrial(self._motion, fault, seed, amount)
        changes: dict[str, Change] = {}
        trial.spoil = changes.__setitem__  # type: ignore[method-assign]
        trial.begin(self._robot)
        for pipe in self._pipes.values():
            pipe.restart()
        for topic, message in self._heard:
            spoiled, time, pipe = message, message.stamp - self._begin, self._pipes[topic]
            if time > 0.0 and topic in changes:
                spoiled = copy.deepcopy(message)
                changes[topic](spoiled, time)
            pipe.reader.arrival = message.stamp
            try:
                pipe._decode(spoiled)
            except SolferError as error:
                return error.line
        return ""


@cache
def _run(motion: str, fault: str, seed: int, silent: float = math.inf) -> Outcome:
    """Return what a robot does that others are compared with; each runs once."""
    return SensorTrial(motion, fault, seed, silent=silent).run()


def _bounds(usual: Outcome, rests: Outcome) -> dict[str, float]:
    return {
        "joint": max(1.0, usual.joint, 1.2 * rests.joint),
        "base": 1.2 * max(usual.base, rests.base) + 0.03,
        "turn": 1.2 * max(usual.turn, rests.turn) + 0.1,
        "wheel": 1.2 * usual.wheel + 0.5,
        "tilt": usual.tilt + math.radians(5.0),
    }


def check_outcome(trial: SensorTrial, outcome: Outcome) -> Outcome:
    """Add what the robot may not do, during the fault and after it.

    It is compared with what it does without a fault, and where it moves by itself (hands that stop let it sway, an arm
    without a motor falls, a wheel that jams turns it) with what it does while it comes to rest: without sensors, from
    the moment on at which the fault was named, or in which it began if it moves the robot.

    A fault moves the robot if a figure comes halfway from what is usual to its bound: then it has to be named,
    unless it is a command. In the end the robot drives as commanded, or says why not.
    """
    if outcome.findings:
        return outcome
    usual = _run(trial.motion, "", 0)
    bounds = _bounds(usual, usual)
    values = {name: getattr(outcome, name) for name in bounds}
    halves = {name: 0.5 * (getattr(usual, name) + bound) for name, bound in bounds.items()}
    moves = [f"{name} {values[name]:.3f} beyond {half:.3f}" for name, half in halves.items() if values[name] > half]
    if any(values[name] > bound for name, bound in bounds.items()):
        if trial.fault in MECHANICAL:
            bounds = _bounds(usual, _run(trial.motion, trial.fault, trial.seed, silent=0.0))
        elif outcome.named:
            bounds = _bounds(usual, _run(trial.motion, "", 0, silent=round(min(outcome.named_after, AFTER), 1)))
    for name, bound in bounds.items():
        if not values[name] <= bound:
            when = outcome.when.get(name, math.nan)
            outcome.findings.append(f"{name} {values[name]:.3f} at +{when:.2f} s, {bound:.3f} at most")
    if moves and outcome.named_after > NAMED and trial.fault not in COMMANDS:
        outcome.findings.append(f"it moves the robot ({', '.join(moves)}), and is not named within {NAMED} s")
    if "locomotion" in outcome.stopped and outcome.rest > 0.02:
        outcome.findings.append(f"it stopped, and still moves by {outcome.rest:.3f} m/s")
    if not outcome.obeys and not outcome.advice:
        outcome.findings.append(f"it neither drives as commanded ({outcome.rest:.3f} m/s) nor says why")
    return outcome


ORDER = np.random.default_rng(0).permutation(list(FAULTS)).tolist()
"""Faults in the order of seeds: consecutive ones draw each of them."""


def drawn(seed: int, faults: Sequence[str] = ORDER) -> SensorTrial:
    """Draw motion and size of a trial, the fault of which has its turn."""
    motion = str(np.random.default_rng(seed).choice(list(MOTIONS)))
    return SensorTrial(motion, faults[seed % len(faults)], seed)
