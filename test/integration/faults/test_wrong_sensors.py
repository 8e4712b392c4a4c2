"""The short form of `benchmark/chaos.py --sensors`: Fig. 5 with sensors, motors and commands that are wrong."""

import pytest
from breaking.alarms import find_alarms
from breaking.sensors import MOTIONS, SensorTrial, drawn, judge

from solfer.pipes.complaints import NAMING_DELAY

NAMED = {
    "gyro_spikes": "an angular velocity of",
    "imu_upside_down": "the tilt leaps by",
    "joint_spikes": "leaps by",
    "second_stick": "are ignored while stick sends",
    "base_jump": "the estimate of the base has jumped",
    "jammed_wheel": "does not follow",
}
"""What the log says of faults, of each in any case."""


@pytest.mark.daily(1)
@pytest.mark.parametrize("fault", NAMED)
@pytest.mark.parametrize("motion", ["drives", "turns"])
def test_a_wrong_sensor_moves_nothing(motion, fault):
    trial = SensorTrial(motion, fault, 4)
    outcome = judge(trial, trial.run())
    assert outcome.complaints == []
    assert any(NAMED[fault] in text for _, text in outcome.named)


@pytest.mark.daily(1)
@pytest.mark.parametrize("seed", [20119, 20183, 20105, 20036])
def test_a_wrong_posture_moves_no_leg(seed):
    """Swapped joints, another sign and other scales of legs that stand: the posture stays refused, or topples it."""
    trial = drawn(seed)
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
