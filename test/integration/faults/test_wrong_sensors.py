"""The short form of `benchmark/chaos.py --sensors`: Fig. 5 with sensors, motors and commands that are wrong."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from breaking.alarms import find_alarms
from breaking.sensor_faults import FAULTS, GRAVITY, LASTS, NUMBERS, SENSORS, turn_about, turn_mounting
from breaking.sensors import MOTIONS, SensorTrial, check_outcome, drawn

from solfer.middleware.memory import Bus
from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_quaternion
from solfer.pipes.pipe_warnings import NAMING_DELAY
from solfer.transport.messages import ImuMessage, copied

NAMED = {
    "gyro_spikes": "an angular velocity of",
    "imu_upside_down": "the tilt leaps by",
    "joint_spikes": "leaps by",
    "second_stick": "are ignored while stick sends",
    "base_jump": "the estimate of the base has jumped",
    "jammed_wheel": "does not follow",
    "effort_sign": "of the robot's weight by the joints' efforts",
}
"""What the log says of faults, of each in any case."""

POSTURES = [
    ("stands", "joints_swapped", 20119),
    ("stands", "joint_scale", 20183),
    ("stands", "joint_sign", 20105),
    ("turns", "joint_scale", 20036),
]
"""Motion, fault and seed of trials with legs that are measured where they are not."""


def turning_imu(fault, seed):
    """Return the true and the wrong messages of an IMU that turns."""
    bus = Bus()
    line = bus.topic("imu", "sensor_msgs/Imu")
    trial = SensorTrial("stands", fault, seed)
    trial.begin(SimpleNamespace(world=SimpleNamespace(bus=bus), joints=[]))
    rate = np.array((0.1, -0.2, 0.3))
    pairs = []
    for time in np.arange(0.0, LASTS + 0.5, 0.002):
        orientation = turn_about(rate / np.linalg.norm(rate), time * np.linalg.norm(rate))
        force = rotation_from_quaternion(orientation).T @ (0.0, 0.0, GRAVITY)
        message = ImuMessage("imu", orientation, rate, acceleration=force, stamp=time)
        line.publish(copied(message), "robot", time)
        pairs.append((message, line.newest))
    return pairs


@pytest.mark.parametrize(("fault", "seed"), [("imu_tilt_drift", 4), ("gyro_warms", 4)])
def test_an_imu_that_drifts_agrees_with_itself(fault, seed):
    """Orientations turn as the gyroscope says; while an IMU turns on its link, its force still points upwards.

    After the drift all is right again.
    """
    pairs = turning_imu(fault, seed)
    wrong = [message for true, message in pairs if true.stamp < LASTS]
    for before, after in pairwise(wrong):
        between = rotation_from_quaternion(before.orientation).T @ rotation_from_quaternion(after.orientation)
        turned = 2.0 * quaternion_from_rotation(between)[:3] / 0.002
        assert turned == pytest.approx(0.5 * (before.angular + after.angular), abs=1e-3)
    true, last = pairs[len(wrong) - 1]
    assert np.abs(last.angular - true.angular).max() > 0.02
    if fault == "imu_tilt_drift":
        assert rotation_from_quaternion(last.orientation) @ last.acceleration == pytest.approx((0.0, 0.0, GRAVITY))
        assert np.abs(last.acceleration - true.acceleration).max() > 0.2
        assert all(np.array_equal(true.orientation, message.orientation) for true, message in pairs[len(wrong) :])


@pytest.mark.soak
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_keeps_the_bounds_and_is_named(fault):
    trial = SensorTrial("drives", fault, 4)
    assert check_outcome(trial, trial.run()).findings == []


def test_consecutive_seeds_have_every_fault():
    assert {drawn(seed).fault for seed in range(90_000, 90_000 + len(FAULTS))} == set(FAULTS)


def drifts(*parts, axis, rate):
    """Let an IMU drift about one of its axes at a rate [rad/s], in some of its numbers, for 3 s."""

    def fault(trial):
        def change(message, time):
            if time < LASTS:
                turn_mounting(message, parts, np.eye(3)["xyz".index(axis)], rate * time, rate=rate)

        trial.spoil("imu", change)

    return fault


def stamped(stamp, *topics):
    """Let topics have other stamps for 3 s; `stamp` is given the right one, the time and the drawn numbers."""

    def fault(trial):
        def change(message, time):
            if time < LASTS:
                message.stamp = stamp(message.stamp, time, trial.draw)

        for topic in topics or SENSORS:
            trial.spoil(topic, change)

    return fault


def jitters(size, *topics):
    return stamped(lambda stamp, time, draw: stamp + draw.uniform(-size, size), *topics)


QUIET = {
    "the tilt drifts": ("drives", drifts("orientation", "angular", axis="x", rate=-0.138)),
    "the heading drifts": ("drives", drifts("orientation", "angular", axis="z", rate=0.35)),
    "stamps jitter by 73 ms": ("turns", jitters(0.073)),
    "stamps jitter by 40 ms": ("stands", jitters(0.04)),
    "stamps of joints jitter": ("turns", jitters(0.02, "joint_states")),
    "stamps are zero": ("turns", stamped(lambda stamp, time, draw: 0.0)),
    "stamps run backwards": ("drives", stamped(lambda stamp, time, draw: stamp - 2.0 * time)),
}
"""Motions, and faults that pass under thresholds and are right again after 3 s."""


@pytest.mark.daily(2)
@pytest.mark.parametrize("name", QUIET)
def test_a_fault_that_ends_moves_the_robot_no_faster_than_commanded(monkeypatch, name):
    """Meanwhile, and when what is measured is right again; then it drives on."""
    motion, fault = QUIET[name]
    monkeypatch.setitem(FAULTS, name, fault)
    trial = SensorTrial(motion, name, 7)
    outcome = check_outcome(trial, trial.run())
    assert outcome.findings == [] and outcome.obeys


@pytest.mark.soak
def test_an_imu_that_turns_on_its_link_and_is_right_again_topples_nothing(monkeypatch):
    """All that it measures is consistent, so the legs follow it by up to 0.3 m/s; what leaps back is refused first."""
    monkeypatch.setitem(FAULTS, "the IMU turns", drifts(*NUMBERS["imu"], axis="y", rate=-0.204))
    outcome = SensorTrial("turns", "the IMU turns", 7).run()
    assert outcome.joint < 1.0 and outcome.base < 0.3 and outcome.wheel < 4.4 and outcome.tilt < 0.12
    assert any("the tilt leaps by" in text for _, text in outcome.named)


@pytest.mark.daily(1)
@pytest.mark.parametrize("fault", NAMED)
@pytest.mark.parametrize("motion", ["drives", "turns"])
def test_a_wrong_sensor_moves_nothing(motion, fault):
    trial = SensorTrial(motion, fault, 4)
    outcome = check_outcome(trial, trial.run())
    assert outcome.findings == []
    assert any(NAMED[fault] in text for _, text in outcome.named)


@pytest.mark.daily(1)
@pytest.mark.parametrize(("motion", "fault", "seed"), POSTURES)
def test_a_wrong_posture_moves_no_leg(motion, fault, seed):
    """Swapped joints, another sign and other scales of legs that stand: the posture stays refused, or topples it."""
    trial = SensorTrial(motion, fault, seed)
    outcome = check_outcome(trial, trial.run())
    assert outcome.findings == [] and outcome.named[0][0] < NAMING_DELAY + 0.02


@pytest.mark.daily(1)
@pytest.mark.parametrize("motion", MOTIONS)
def test_joints_that_freeze_are_named_and_the_robot_rests_meanwhile(motion):
    """All plugins hold, and go on when joints move again: neither the estimate of the base nor hands have run away."""
    outcome = SensorTrial(motion, "joints_freeze", 4).run()
    frozen = next(time for time, text in outcome.named if "no number has changed, though joints were" in text)
    assert frozen < 0.25
    assert outcome.joint < 0.5 and outcome.base < 0.3 and outcome.tilt < 0.02
    assert outcome.pause < 0.02 and outcome.rest == pytest.approx(MOTIONS[motion][0], rel=0.1, abs=0.02)


@pytest.mark.daily(1)
@pytest.mark.parametrize("seed", [0, 1])
def test_noise_pushes_resets_and_a_fall_contradict_no_sensor(seed):
    alarms, lies = find_alarms(seed, 3.0)
    assert alarms == [] and lies
