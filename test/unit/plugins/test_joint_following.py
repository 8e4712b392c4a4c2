"""Joints that do not follow their commands, and those that merely give way, lag behind or rest."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from solfer.plugins.outputs.following import JointFollowing

PERIOD = 0.005
DOFS = ("x", "shoulder", "elbow", "roll")


class FollowedJoints:
    """Two joints with position controllers, a wheel with a velocity controller, and what watches them."""

    def __init__(self, measured=(True, True, True, True), stiffness=None, efforts=True):
        self.state = {"position": np.zeros(4), "velocity": np.zeros(4), "torque": np.zeros(4)}
        self.place, self.speed = np.zeros(2), np.zeros(1)
        fields = [("position", self.place), *([] if stiffness is None else [("stiffness", np.array(stiffness))])]
        joints = SimpleNamespace(dofs=np.array([1, 2]), fields=fields)
        wheel = SimpleNamespace(dofs=np.array([3]), fields=[("velocity", self.speed)])
        kinematics = SimpleNamespace(effort_limit=np.array([0.0, 100.0, 50.0, 30.0]))
        robot = SimpleNamespace(dofs=DOFS, state=self.state, kinematics=kinematics)
        known = dict.fromkeys(("position", "velocity"), np.array(measured)) | {"effort": np.full(4, efforts)}
        self.following = JointFollowing("legs", [joints, wheel], robot, known)

    def run(self, duration, moves=lambda time: None):
        """Check for a time [s]; return the fault, None if there is none, and when it was found [s]."""
        for cycle in range(round(duration / PERIOD)):
            moves(cycle * PERIOD)
            if fault := self.following.check(PERIOD):
                return fault, cycle * PERIOD
        return None, duration


def test_joints_that_follow_are_no_fault():
    """Springs that give way, a swing for a moment, a wheel that lags behind, turns back, or coasts a little."""
    arm = FollowedJoints()

    def moves(time):
        arm.place[:] = math.sin(3.0 * time), 0.2
        arm.state["position"][1] = arm.place[0] - (1.3 if 1.0 < time % 2.0 < 1.4 else 0.9)
        arm.speed[0] = 3.0 * math.sin(5.0 * time)
        arm.state["velocity"][3] = 3.0 * math.sin(5.0 * (time - 0.03)) + 0.1

    assert arm.run(20.0, moves) == (None, 20.0)


@pytest.mark.parametrize("place", [0, 1])
def test_a_joint_that_stays_away_is_named(place):
    arm = FollowedJoints()
    arm.place[place] = -1.1
    fault, time = arm.run(1.0)
    assert time == pytest.approx(0.5, abs=0.011)
    assert fault.what == f"joint '{DOFS[1 + place]}' does not follow 'legs': it is at 0.000 instead of -1.100 rad"


@pytest.mark.parametrize(
    ("away", "effort", "measured", "is_named"),
    [(-0.1, -50.0, True, True), (0.1, 49.5, True, True), (0.1, -50.0, True, False), (0.1, 45.0, True, False),
     (0.02, 50.0, True, False), (0.1, 50.0, False, False)],
)  # fmt: skip
def test_a_joint_that_is_pulled_in_vain_is_named(away, effort, measured, is_named):
    arm = FollowedJoints(stiffness=(100.0, 100.0), efforts=measured)
    arm.place[1], arm.state["torque"][2] = away, effort
    fault, time = arm.run(1.0)
    assert (fault is not None and f"instead of {away:.3f} rad, with {effort:.0f} Nm" in fault.what) == is_named
    assert time == pytest.approx(0.3 if is_named else 1.0, abs=0.011)


@pytest.mark.parametrize(("desired", "measured"), [(2.5, 0.0), (-2.5, 0.1), (2.5, -1.0), (2.5, 0.4)])
def test_a_wheel_that_is_jammed_or_dead_is_named(desired, measured):
    arm = FollowedJoints()
    arm.speed[0], arm.state["velocity"][3] = desired, measured
    fault, time = arm.run(2.0)
    assert time < 0.5 and "joint 'roll' does not follow 'legs': it has turned by" in fault.what


def test_what_is_not_measured_or_has_no_stiffness_is_not_watched():
    unknown = FollowedJoints(measured=(True, True, False, False))
    unknown.place[1], unknown.speed[0] = 2.0, 5.0
    assert unknown.run(2.0)[0] is None
    carried = FollowedJoints(stiffness=(0.0, 100.0))
    carried.place[0] = 2.0
    assert carried.run(2.0)[0] is None
    carried.place[1] = 2.0
    assert "elbow" in carried.run(2.0)[0].what


def test_a_start_forgets():
    arm = FollowedJoints()
    arm.speed[0] = 2.5
    for _ in range(10):
        assert arm.run(0.15) == (None, 0.15)
        arm.following.start()


@pytest.mark.parametrize("speed", [2.5, -10.0])
def test_a_wheel_that_jams_while_it_turns_is_named_by_what_it_has_not_turned_since(speed):
    arm = FollowedJoints()
    arm.speed[0] = arm.state["velocity"][3] = speed
    assert arm.run(5.0) == (None, 5.0)
    arm.state["velocity"][3] = 0.0
    fault, time = arm.run(1.0)
    assert time == pytest.approx(0.5 / abs(speed), abs=2 * PERIOD)
    assert "it has turned by 0.00 rad, and lags by 0.5" in fault.what
