"""What a robot may do after a fault: nothing that was not commanded.

Times are the robot's own.
"""

from dataclasses import dataclass, field

import numpy as np

from breaking.record import Samples

REST = 1.2
"""Longest time from a fault until wheels without commands have come to rest [s]."""

AFTER = 3.0
"""Time after a fault in which the robot is watched [s]."""

WHEEL_REST = 0.05
"""Largest speed of a wheel at rest [rad/s]."""

WHEEL_EXCESS = 0.1
"""How far a wheel's speed may be beyond what lies between rest and what is asked for [rad/s]."""

AWAY = 0.05
"""How far a joint may be from its path, or from where it was [rad]."""

SWING = 0.06
"""The same while wheels speed up or brake, which swings joints on their springs by up to 0.057 rad [rad]."""

SPEED = 2.0
"""Largest speed of a joint; 0.5 are asked for [rad/s].

Plugins follow the machine's clock. Where the robot's time passes more slowly than that, joints that are moved are
faster in it by as much, and come to rest later.
"""

PACE = 0.2
"""Robot's time over which it is looked at how fast that passes [s]."""

BRAKES = 0.5
"""A rate of change of a wheel's speed above which joints swing [rad/s2]; what is asked for is 3."""

SWINGS_ON = 0.5
"""How long they do afterwards [s]."""

WINDOW = 0.1
"""Time over which rates of change are looked at, and for which a wheel has to be slow to be at rest [s]."""


@dataclass(frozen=True)
class Expected:
    """What was commanded, and what of it the fault makes forgotten.

    Attributes:
        wheels: Which joints are wheels, shape (joints,), bool.
        low: Lower end of what was asked for: the least position between start and goal, shape (joints,) [rad].
        high: Upper end.
        speeds: What was asked of the wheels, shape (joints,); of the other joints nothing [rad/s].
        begin: When the first fault began [s].
        end: When the last one ended: the process was killed, or went on [s].
        forgotten: Joints that stop moving with the fault, shape (joints,), bool.
    """

    wheels: np.ndarray
    low: np.ndarray
    high: np.ndarray
    speeds: np.ndarray
    begin: float
    end: float
    forgotten: np.ndarray


@dataclass
class Verdict:
    """What was worst, and what of it is too much.

    Attributes:
        wheel: Largest speed of a wheel that has to be at rest [rad/s].
        excess: Largest speed of a wheel beyond what is asked for [rad/s].
        away: Largest distance of a joint from its path, or from where it was [rad].
        swing: The same while wheels speed up or brake [rad].
        speed: Largest speed of a joint [rad/s].
        findings: What is beyond its bound, in words.
    """

    wheel: float = 0.0
    excess: float = 0.0
    away: float = 0.0
    swing: float = 0.0
    speed: float = 0.0
    findings: list[str] = field(default_factory=list)

    def add(self, other: "Verdict") -> None:
        """Keep the worse figures of both, and all findings."""
        for name in FIGURES:
            setattr(self, name, max(getattr(self, name), getattr(other, name)))
        self.findings += other.findings


FIGURES = ("wheel", "excess", "away", "swing", "speed")


def check_motion(joints: tuple[str, ...], samples: Samples, expected: Expected) -> Verdict:
    """Check what a robot did from the fault on.

    Args:
        joints: Names of the joints.
        samples: What they did, from before the fault on.
        expected: What they may do.
    """
    verdict, held = Verdict(), ~expected.wheels
    since = samples.times >= expected.begin
    _wheels(verdict, joints, samples, expected)
    _speeds(verdict, joints, samples, since, held)
    _distances(verdict, joints, samples, expected, since)
    return verdict


def _distances(
    verdict: Verdict, joints: tuple[str, ...], samples: Samples, expected: Expected, since: np.ndarray
) -> None:
    """Check that joints stay on their paths, or where they were."""
    away, swings = _away(samples, expected), braking(samples.times, samples.velocities[:, expected.wheels])
    away[:, expected.wheels] = 0.0
    moved = expected.high > expected.low
    away[:, moved] *= _pace(samples)[:, None]
    for name, when, bound in (("away", since & ~swings, AWAY), ("swing", since & swings, SWING)):
        worst = float(away[when].max(initial=0.0))
        setattr(verdict, name, worst)
        if worst > bound:
            row, column = np.unravel_index(np.where(when[:, None], away, 0.0).argmax(), away.shape)
            words = "while wheels brake or speed up" if name == "swing" else "off its path, or off where it was"
            verdict.findings.append(
                f"{joints[column]} {worst:.3f} rad {words}, {samples.times[row] - expected.end:.2f} s after the fault"
            )


def check_return(
    joints: tuple[str, ...], samples: Samples, wheels: np.ndarray, since: float, fastest: float
) -> Verdict:
    """Check what a robot did after a new request; a plugin that starts anew may carry it out.

    Args:
        joints: Names of the joints.
        samples: What they did.
        wheels: Which joints are wheels, shape (joints,), bool.
        since: When it was asked [s].
        fastest: The most that was ever asked of a wheel [rad/s].
    """
    verdict, afterwards = Verdict(), samples.times >= since
    _speeds(verdict, joints, samples, afterwards, ~wheels)
    verdict.excess = float(np.abs(samples.velocities[afterwards][:, wheels]).max(initial=0.0)) - fastest
    if verdict.excess > WHEEL_EXCESS:
        verdict.findings.append(f"a wheel turned {verdict.excess:.2f} rad/s faster than ever asked for")
    return verdict


def _speeds(verdict: Verdict, joints: tuple[str, ...], samples: Samples, when: np.ndarray, held: np.ndarray) -> None:
    """Check that joints move no faster than they may, by the machine's clock."""
    speeds = (np.abs(samples.velocities[:, held]) * _pace(samples)[:, None])[when]
    verdict.speed = float(speeds.max(initial=0.0))
    if verdict.speed > SPEED:
        row, column = np.unravel_index(speeds.argmax(), speeds.shape)
        verdict.findings.append(
            f"{np.array(joints)[held][column]} moved at {verdict.speed:.2f} rad/s at {samples.times[when][row]:.2f} s"
        )


def _pace(samples: Samples) -> np.ndarray:
    """Compute how fast the robot's time passed, of the machine's, 1 at most, shape (k,)."""
    before = np.maximum(np.searchsorted(samples.times, samples.times - PACE) - 1, 0)
    passed, lasted = samples.times - samples.times[before], samples.arrivals - samples.arrivals[before]
    return np.where(passed > 0.0, passed / np.maximum(lasted, np.maximum(passed, 1e-6)), 1.0)


def braking(times: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Find when wheels speed up or brake, or have done so not long ago, shape (k,), bool."""
    if not speeds.shape[1]:
        return np.zeros(len(times), dtype=bool)
    before = np.searchsorted(times, times - WINDOW)
    change = np.abs(speeds - speeds[before]).max(axis=1) > BRAKES * WINDOW
    newest = np.maximum.accumulate(np.where(change, times, -np.inf))
    return times - newest <= SWINGS_ON


def _away(samples: Samples, expected: Expected) -> np.ndarray:
    """Compute the distance of each joint from where it may be, shape (k, joints) [rad]."""
    low, high = (np.tile(bound, (len(samples.times), 1)) for bound in (expected.low, expected.high))
    afterwards = samples.times > expected.end
    meanwhile = (samples.times >= expected.begin - WINDOW) & ~afterwards
    if meanwhile.any():
        where = samples.positions[meanwhile]
        rest = np.ix_(afterwards, expected.forgotten)
        low[rest], high[rest] = where.min(axis=0)[expected.forgotten], where.max(axis=0)[expected.forgotten]
    return np.maximum(np.maximum(low - samples.positions, samples.positions - high), 0.0)


def _wheels(verdict: Verdict, joints: tuple[str, ...], samples: Samples, expected: Expected) -> None:
    """Check that wheels turn no faster than commanded, and that those without commands come to rest and stay there."""
    since = samples.times >= expected.begin
    times, speeds = samples.times[since], samples.velocities[since][:, expected.wheels]
    if not speeds.size:
        return
    asked = expected.speeds[expected.wheels]
    low, high = np.minimum(asked, 0.0), np.maximum(asked, 0.0)
    verdict.excess = float(np.maximum(low - speeds, speeds - high).max(initial=0.0))
    if verdict.excess > WHEEL_EXCESS:
        verdict.findings.append(f"a wheel turned {verdict.excess:.2f} rad/s faster than asked for")
    if not expected.forgotten[expected.wheels].all():
        return
    worst = np.abs(speeds).max(axis=1)
    afterwards = times >= min(_rest(times, worst, expected.end), expected.end + REST)
    verdict.wheel = float(worst[afterwards].max(initial=0.0))
    if verdict.wheel > WHEEL_REST:
        moment = times[afterwards][worst[afterwards].argmax()] - expected.end
        verdict.findings.append(
            f"a wheel without commands turned at {verdict.wheel:.2f} rad/s, {moment:.2f} s after the fault"
        )


def _rest(times: np.ndarray, speeds: np.ndarray, end: float) -> float:
    """Find when the wheels came to rest after the `end` of the fault: slow for WINDOW [s]; infinity: never."""
    last = times[0]  # when they turned last
    for time, speed in zip(times, speeds, strict=True):
        if speed > WHEEL_REST:
            last = time
        elif time >= end and time - last >= WINDOW:
            return float(time)
    return np.inf
