"""What is said of a robot after a fault: each thing that nobody asked for is seen, and what was asked for is none."""

from dataclasses import replace

import numpy as np
import pytest
from breaking.bounds import AWAY, Expected, check_motion, check_return
from breaking.record import Record, Samples

JOINTS = ("arm", "leg", "wheel")
WHEELS = np.array([False, False, True])
BEGIN, END, LAST = 1.0, 1.5, 4.5  # [s]
ASKED = 1.0  # [rad/s], of the wheel
GOAL = 0.5  # [rad], of the arm
TIMES = np.arange(0.0, LAST, 0.005)

ASKED_FOR = Expected(
    WHEELS, np.zeros(3), np.array([GOAL, 0.0, 0.0]), np.array([0.0, 0.0, ASKED]), BEGIN, END, np.zeros(3, dtype=bool)
)
FORGOTTEN = replace(ASKED_FOR, forgotten=np.ones(3, dtype=bool))
"""The motion goes on as asked; it ends with the fault."""


def robot(ends: bool) -> Samples:
    """Make a robot whose arm moves to its goal and whose wheel turns, until the end of the fault if that `ends`."""
    moving = TIMES <= (END if ends else LAST)
    speed = np.where(moving & (TIMES < 0.3 + GOAL / 0.25), 0.25, 0.0)
    velocities = np.stack(
        [speed, 0.0 * TIMES, np.where(moving, ASKED, np.maximum(0.0, ASKED - 3.0 * (TIMES - END)))], 1
    )
    positions = np.stack([np.minimum(np.cumsum(speed) * 0.005, GOAL), 0.0 * TIMES, np.cumsum(velocities[:, 2])], 1)
    return Samples(TIMES, positions, velocities, TIMES.copy())


def finding_of(samples: Samples, expected: Expected) -> str:
    """Return the only one."""
    (found,) = check_motion(JOINTS, samples, expected).findings
    return found


def test_a_motion_that_goes_on_as_asked():
    verdict = check_motion(JOINTS, robot(False), ASKED_FOR)
    assert not verdict.findings
    assert verdict.excess == pytest.approx(0.0)
    assert verdict.wheel == 0.0  # nothing has to be at rest


def test_a_motion_that_ends_with_the_fault():
    verdict = check_motion(JOINTS, robot(True), FORGOTTEN)
    assert not verdict.findings
    assert verdict.away < 0.002


@pytest.mark.parametrize("joint", ["arm", "wheel"])
def test_a_motion_that_should_have_ended(joint):
    moves, ends = robot(False), robot(True)
    column = JOINTS.index(joint)
    ends.positions[:, column], ends.velocities[:, column] = moves.positions[:, column], moves.velocities[:, column]
    findings = check_motion(JOINTS, ends, FORGOTTEN).findings
    assert findings and all(joint in words for words in findings)


@pytest.mark.parametrize(
    ("begin", "end", "speed", "words"),
    [(3.0, 3.2, 0.06, "0.06 rad/s, 1.50 s after"), (END, END + 1.3, 0.1, "0.10 rad/s")],
)
def test_wheels_that_turn_without_commands(begin, end, speed, words):
    """They drive off again, or take too long to rest."""
    samples = robot(True)
    samples.velocities[(samples.times > begin) & (samples.times < end), 2] = speed
    assert f"a wheel without commands turned at {words}" in finding_of(samples, FORGOTTEN)
    assert not check_motion(JOINTS, samples, ASKED_FOR).findings


@pytest.mark.parametrize("speed", [ASKED + 0.2, -0.2])
def test_wheels_beyond_what_is_asked_for(speed):
    samples = robot(False)
    samples.velocities[500, 2] = speed
    assert "a wheel turned 0.20 rad/s faster than asked for" in finding_of(samples, ASKED_FOR)


def test_a_joint_that_is_thrown():
    samples = robot(False)
    samples.velocities[400, 1] = -2.5
    assert finding_of(samples, ASKED_FOR).startswith("leg moved at 2.50 rad/s")


def test_a_joint_that_leaves_its_path():
    samples = robot(False)
    samples.positions[700, 1] = AWAY + 0.01
    assert finding_of(samples, ASKED_FOR).startswith("leg 0.060 rad off its path")


def test_joints_may_swing_farther_while_wheels_brake():
    samples = robot(True)
    samples.positions[TIMES.searchsorted(END + 0.2), 1] = AWAY + 0.005
    assert not check_motion(JOINTS, samples, FORGOTTEN).findings
    samples.positions[TIMES.searchsorted(END + 0.2), 1] = AWAY + 0.02
    assert finding_of(samples, FORGOTTEN).startswith("leg 0.070 rad while wheels brake")


def test_a_slow_machine_makes_no_joint_too_fast():
    samples = robot(False)
    samples.velocities[400:600, 0] = 2.5
    slow = samples._replace(arrivals=2.0 * samples.arrivals)
    assert check_motion(JOINTS, samples, ASKED_FOR).findings
    assert not check_motion(JOINTS, slow, ASKED_FOR).findings


def test_a_return_that_nobody_asked_for():
    samples = robot(False)
    assert not check_return(JOINTS, samples, WHEELS, END, ASKED).findings
    samples.velocities[-1] = 0.0, 2.5, ASKED + 0.2
    speed, wheel = check_return(JOINTS, samples, WHEELS, END, ASKED).findings
    assert speed.startswith("leg moved at 2.50 rad/s") and wheel.startswith("a wheel turned 0.20 rad/s faster")


def test_a_simulator_that_begins_anew_has_another_robot():
    record = Record()
    for stamp in (1.0, 2.0, 0.5, 1.5):
        record.add(stamp, JOINTS, np.full(3, stamp), np.zeros(3))
    assert record.robots == 1
    assert [list(record.samples(number).times) for number in (0, 1)] == [[1.0, 2.0], [0.5, 1.5]]
