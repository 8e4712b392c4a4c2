"""Joints without ends whose encoders, or whose commands, count within a turn."""

import math

import numpy as np
import pytest
from support.unit.joint_pipes import make_robot

from solfer.lower_level.laws.controllers import ImpedanceController
from solfer.lower_level.laws.limits import JointLimits
from solfer.lower_level.lower_level import LowerLevel
from solfer.transport.messages import JointMessage

PERIOD, SPEED = 0.001, 3.0


def wrapped(angle):
    """Count in (-pi, pi]."""
    return math.pi - (math.pi - angle) % math.tau


class TurningWheel:
    """The lower level of a robot with the wheel `roll`."""

    def __init__(self):
        robot = make_robot()
        self.dof, self.size = robot.dof("roll"), robot.size
        limits = JointLimits(
            ("roll",), np.array([self.dof]), np.array([-np.inf]), np.array([np.inf]), np.array([10.0]), np.array([50.0])
        )
        self.controller = ImpedanceController("wheels", limits, [100.0], [1.0])
        self.level = LowerLevel(robot.kinematics, [self.controller], passive=("shoulder",))
        self.level.start(np.zeros(self.size))

    def step(self, measured, desired):
        """Command and measure once; return the torque [Nm]."""
        self.level.accept("wheels", JointMessage(("roll",), np.array([desired])))
        q, v = np.zeros(self.size), np.zeros(self.size)
        q[self.dof], v[self.dof] = measured, SPEED
        return self.level.update(q, v, PERIOD)[0][self.dof]


COUNTS = {"wraps": wrapped, "counts on": float, "counts on, far away": lambda angle: angle + 20.0 * math.tau}


@pytest.mark.parametrize("desired", COUNTS.values(), ids=COUNTS)
@pytest.mark.parametrize("measured", [wrapped, float], ids=["wraps", "counts on"])
def test_torques_do_not_depend_on_the_count(measured, desired):
    usual, other = TurningWheel(), TurningWheel()
    for step in range(4000):
        angle = SPEED * PERIOD * step
        expected = usual.step(angle, angle + 0.1)
        assert other.step(measured(angle), desired(angle + 0.1)) == pytest.approx(expected, abs=1e-9)


def test_a_command_of_another_turn_is_no_way():
    scene = TurningWheel()
    scene.step(0.0, 6.0 * math.tau + 0.1)
    assert scene.controller.position[0] == pytest.approx(0.1)
    name, distance = scene.controller.away(np.array([0]), {"position": np.array([math.tau - 0.1])})
    assert name == "roll" and distance < 0.2
