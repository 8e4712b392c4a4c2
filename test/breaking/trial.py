"""One trial: a motion, a fault in it, what the robot does then, and whether all processes go on."""

import random
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from support.processes import until

from breaking.bounds import AFTER, Expected, Verdict, check_motion, check_return
from breaking.processes import WAIT
from breaking.systems import MOVED, TRY, WHEELS, System, lower

SURE = 0.22
"""A process that has stood still for so long has found that out: its own limit is 0.2 s. On a busy machine it may find
out after less [s]."""

SHORTEST, LONGEST = 0.02, 3.0
"""Times for which a process is stopped [s]."""

SECOND = 0.5
"""Longest time from one fault to the next in a trial with two of them [s]."""

ATTEMPTS = 5
SETS_OUT = 1.0
"""Longest time until a motion is seen that is `moment` old, of a robot with slow time [s]."""

SET_OUT = 2e-3
"""How far a joint has moved that has set out [rad]."""


@dataclass(frozen=True)
class Fault:
    """What happens to a process.

    Attributes:
        kind: `stop` for a while, `kill`, or `restart`: ask it to end, and start it again.
        victim: Name of the process.
        duration: For how long it is stopped [s].
        delay: Time since the first fault of the trial [s].
    """

    kind: str
    victim: str
    duration: float = 0.0
    delay: float = 0.0

    def __str__(self) -> str:
        for_how_long = f" for {self.duration:.3f} s" if self.kind == "stop" else ""
        return f"{self.kind} {self.victim}{for_how_long}" + (f" {self.delay:.2f} s later" if self.delay else "")


@dataclass(frozen=True)
class Plan:
    """A trial.

    Attributes:
        faults: What happens, in the order of their delays.
        moment: When the first one happens, by the machine's clock, as the plugins that move the robot: since the motion
            was asked for [s].
        upper: How far the moved joints of the upper body go from home [rad].
        lower: The same of the lower body.
        speed: Of the wheels [rad/s].
    """

    faults: tuple[Fault, ...]
    moment: float = 0.8
    upper: tuple[float, ...] = (0.5, 0.5)
    lower: tuple[float, ...] = (0.0, 0.0)
    speed: float = 1.0


def draw(seed: int, victims: tuple[str, ...]) -> Plan:
    """Draw a plan at random.

    Args:
        seed: Equal seeds make equal plans.
        victims: Processes that may be broken.
    """
    chance = random.Random(str(seed))  # numbers next to each other would make plans that are alike
    count = 2 if chance.random() < 0.3 and len(victims) > 1 else 1
    faults = []
    for place, victim in enumerate(chance.sample(victims, count)):
        kind = chance.choices(("stop", "kill", "restart"), (6, 3, 2))[0]
        duration = SHORTEST * (LONGEST / SHORTEST) ** chance.random() if kind == "stop" else 0.0
        faults.append(Fault(kind, victim, duration, chance.uniform(0.0, SECOND) if place else 0.0))
    upper = chance.choice((-1.0, 1.0)) * chance.uniform(0.4, 0.6), chance.uniform(0.4, 0.6)
    drives = chance.random() < 0.7  # wheels that turn while the ankles steer drag the legs about
    legs = (
        (0.0, 0.0) if drives else tuple(chance.choice((-1.0, 1.0)) * chance.uniform(0.2, 0.4) for _ in MOVED["lower"])
    )
    speed = chance.choice((-1.0, 1.0)) * chance.uniform(1.0, 2.0) if drives else 0.0
    return Plan(tuple(faults), chance.uniform(0.3, 1.0), upper, legs, speed)


class Trial:
    """Carries out a plan on a system that is at home and at rest.

    Args:
        system: The system; after `run` it is at home and at rest again, if nothing is wrong.
        plan: What happens.
    """

    def __init__(self, system: System, plan: Plan):
        self._system, self._plan, self.plan = system, plan, plan
        self._end, self._watched = 0.0, 0.0

    def run(self) -> Verdict:
        """Carry it out; returns what the robot did."""
        verdict = Verdict()
        try:
            self._run(verdict)
        except AssertionError as error:
            verdict.findings.append(str(error))
        verdict.findings += self._system.processes.errors()
        return verdict

    def _run(self, verdict: Verdict) -> None:
        system, record, plan = self._system, self._system.record, self._plan
        record.forget()
        robot = record.robots
        expected = replace(self._set_in_motion(), begin=record.time)
        self._break()
        if record.robots == robot:
            self._end = record.time
        else:
            self._end = float(record.samples(record.robots).times[0])
        system.passes(AFTER, self._end)
        self._watched = record.time
        verdict.add(self._check(robot, expected))
        system.revive()
        system.obey(-TRY if plan.speed > 0.0 else TRY)
        verdict.add(
            check_return(
                record.joints, record.samples(record.robots), expected.wheels, self._watched, max(abs(plan.speed), TRY)
            )
        )

    def _set_in_motion(self) -> Expected:
        """Request the motion; returns when it is `moment` old, and seen. A late plugin on a busy machine forgets it.

        Raises:
            AssertionError: There is no motion, though it is requested again and again.
        """
        for _ in range(ATTEMPTS):
            expected = self._ask()
            before = {joint: self._system.record.position(joint) for joint in MOVED["upper"]}
            time.sleep(self._plan.moment)
            try:
                until(partial(self._moves, before), "a motion", SETS_OUT)
                return expected
            except AssertionError:
                self._system.obey()
        raise AssertionError(f"no motion, though it was asked for {ATTEMPTS} times")

    def _moves(self, before: Mapping[str, float]) -> bool:
        """Return whether joints of the upper body have left where they were, and wheels turn if they shall."""
        record = self._system.record
        wheel, sign = next(iter(WHEELS.items()))
        return all(abs(record.position(joint) - place) > SET_OUT for joint, place in before.items()) and (
            sign * record.velocity(wheel) * self._plan.speed >= 0.1 * self._plan.speed**2
        )

    def _ask(self) -> Expected:
        """Request the motion."""
        record = self._system.record
        speeds = np.array([self._plan.speed * WHEELS.get(joint, 0.0) for joint in record.joints])
        wheels = np.array([joint in WHEELS for joint in record.joints])
        low = np.array([record.position(joint) for joint in record.joints])
        high = low.copy()
        for part, offsets in (("upper", self._plan.upper), ("lower", self._plan.lower)):
            goals = [self._system.home[joint] + offset for joint, offset in zip(MOVED[part], offsets, strict=True)]
            for joint, goal in zip(MOVED[part], goals, strict=True):
                place = record.joints.index(joint)
                low[place], high[place] = min(low[place], goal), max(high[place], goal)
            self._system.ask(part, goals, self._plan.speed)
        return Expected(wheels, low, high, speeds, 0.0, 0.0, np.zeros(len(wheels), dtype=bool))

    def _break(self) -> None:
        """Carry out the faults of the plan; returns when the last one has ended."""
        system, begin, ending = self._system, time.monotonic(), []
        timeline = sorted(
            [(fault.delay, fault, True) for fault in self._plan.faults]
            + [(fault.delay + fault.duration, fault, False) for fault in self._plan.faults if fault.kind == "stop"],
            key=lambda event: event[0],
        )

        def over() -> bool:
            while timeline and time.monotonic() - begin >= timeline[0][0]:
                _, fault, begins = timeline.pop(0)
                self._act(fault, begins)
                if fault.kind == "restart":
                    ending.append(fault.victim)
            for name in [name for name in ending if system.processes.ended(name)]:
                ending.remove(name)
                self._start(name)
            return not timeline and not ending

        until(over, f"the end of {' and '.join(map(str, self._plan.faults))}", WAIT + LONGEST)

    def _act(self, fault: Fault, begins: bool) -> None:
        processes = self._system.processes
        if fault.kind == "stop":
            (processes.stop if begins else processes.go_on)(fault.victim)
            if fault.victim == self._system.simulator:
                self._system.record.stopped += -time.monotonic() if begins else time.monotonic()
        elif fault.kind == "restart":
            processes.terminate(fault.victim)
        else:
            processes.kill(fault.victim)
            if fault.victim == self._system.simulator:
                self._start(fault.victim)

    def _start(self, name: str) -> None:
        """Start a process that has ended; without a robot there is nothing to check."""
        if name == self._system.simulator:
            self._system.replace_robot()
        else:
            self._system.processes.start(name)

    def _check(self, robot: int, expected: Expected) -> Verdict:
        """Check what the robot did until the end of WATCH; a simulator that began anew has another one."""
        record = self._system.record
        if record.robots == robot:
            forgotten = np.array([self._forgotten(joint) for joint in record.joints])
            allowed = replace(expected, end=self._end, forgotten=forgotten)
            return check_motion(record.joints, record.samples(robot), allowed)
        first = record.samples(robot)
        verdict = check_motion(record.joints, first, replace(expected, end=first.times[-1]))
        samples = record.samples(record.robots)
        place, everything = samples.positions[0], np.ones(len(record.joints), dtype=bool)
        verdict.add(
            check_motion(
                record.joints,
                samples,
                Expected(expected.wheels, place, place, np.zeros(len(place)), self._end, self._end, everything),
            )
        )
        return verdict

    def _forgotten(self, joint: str) -> bool:
        """Return whether the plan's faults end the motion of a joint."""
        part = "lower" if lower(joint) else "upper"
        return any(
            part in self._system.ends(fault.victim, fault.kind == "restart")
            for fault in self._plan.faults
            if fault.kind != "stop" or fault.duration >= SURE
        )
