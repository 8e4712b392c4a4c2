"""The short form of `benchmark/chaos.py --sensors`: Fig. 5 with sensors, motors and commands that are wrong."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from breaking.alarms import find_alarms
from breaking.sensor_faults import FAULTS, GRAVITY, LASTS, turn_about
from breaking.sensors import MOTIONS, SensorTrial, drawn, judge

from solfer.middleware.memory import Bus
from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_quaternion
from solfer.pipes.complaints import NAMING_DELAY
from solfer.transport.messages import ImuMessage, copied

NAMED = {
    "gyro_spikes": "an angular velocity of",
    "imu_upside_down": "the tilt leaps by",
    "joint_spikes": "leaps by",
    "second_stick": "are ignored while stick sends",
    "base_jump": "the estimate of the base has jumped",
    "jammed_wheel": "does not follow",
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
    assert judge(trial, trial.run()).complaints == []


def test_consecutive_seeds_have_every_fault():
    assert {drawn(seed).fault for seed in range(90_000, 90_000 + len(FAULTS))} == set(FAULTS)


@pytest.mark.daily(1)
@pytest.mark.parametrize("fault", NAMED)
@pytest.mark.parametrize("motion", ["drives", "turns"])
def test_a_wrong_sensor_moves_nothing(motion, fault):
    trial = SensorTrial(motion, fault, 4)
    outcome = judge(trial, trial.run())
    assert outcome.complaints == []
    assert any(NAMED[fault] in text for _, text in outcome.named)


@pytest.mark.daily(1)
@pytest.mark.parametrize(("motion", "fault", "seed"), POSTURES)
def test_a_wrong_posture_moves_no_leg(motion, fault, seed):
    """Swapped joints, another sign and other scales of legs that stand: the posture stays refused, or topples it."""
    trial = SensorTrial(motion, fault, seed)
    outcome = judge(trial, trial.run())
    assert outcome.complaints == [] and outcome.named[0][0] < NAMING_DELAY + 0.02


@pytest.mark.daily(1)
@pytest.mark.parametrize("motion", ["drives", "turns"])
def test_joints_that_freeze_are_named_and_the_robot_rests_meanwhile(motion):
    """All plugins hold, and go on when joints move again: the estimate of the base has not run away."""
    outcome = SensorTrial(motion, "joints_freeze", 4).run()
    frozen = next(time for time, text in outcome.named if "no number has changed, though joints were" in text)
    assert frozen < 0.25
    assert outcome.joint < 1.0 and outcome.base < 0.3 and outcome.tilt < 0.02
    assert outcome.pause < 0.02 and outcome.rest == pytest.approx(MOTIONS[motion][0], rel=0.1)


@pytest.mark.daily(1)
@pytest.mark.parametrize("seed", [0, 1])
def test_noise_pushes_resets_and_a_fall_contradict_no_sensor(seed):
    alarms, lies = find_alarms(seed, 4.0)
    assert alarms == [] and lies
