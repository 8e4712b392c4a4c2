"""References that are dragged move a hand in memory, and stop as every sender does."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import upper_body

from solfer.components.inverse_kinematics import InverseKinematics
from solfer.config import read
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.robot import Robot
from solfer.transport import Inbox, JointMessage
from solfer.transport.declared import bind
from solfer_tools.scene import DraggedReferences, LiveScene, ScenePose
from solfer_tools.scene.dragging import OPERATOR_SILENCE

HANDS = """
hands:
  stack:
    tasks:
      left: {point: position, link: arm1_7, relative: torso_2, gain: 10}
      posture: {point: posture, gain: 0.5, weight: 0.0001}
    levels: [[left, posture]]
"""
PERIOD = 0.01


class Hands:
    """Inverse kinematics of an upper body on a bus, and a scene of it."""

    def __init__(self, repository, tmp_path):
        (file := tmp_path / "hands.yaml").write_text(HANDS)
        self.bus, self.robot = Bus(), upper_body()
        self.component = InverseKinematics(self.robot, read(file, InverseKinematics.Tags, ("hands",)), "hands")
        self.component.set_rate(1.0 / PERIOD)
        self.component.init()
        node, self.inbox = MemoryMiddleware(self.bus, "hands"), Inbox()
        self.published = bind("hands", self.component.topics(), node, self.inbox, rate=1.0 / PERIOD)
        self.states = node.writer("joint_states", "sensor_msgs/JointState")
        viewer = MemoryMiddleware(self.bus, "scene")
        self.scene = LiveScene(Robot.load(self.robot.description.text), viewer)
        self.dragged = DraggedReferences(viewer)
        self.bus.every(PERIOD, self.cycle)
        self.run(1.5)

    def cycle(self):
        self.inbox.apply()
        self.component.update()
        self.component.send()
        self.published.left -= 1
        if not self.published.left:
            self.published.run()
        self.states.write(JointMessage(tuple(self.robot.dofs), position=self.robot.command.position.copy()))

    def run(self, duration):
        """Let a time pass [s] with the scene at 20 Hz; returns the reference."""
        for _ in range(round(duration / 0.05)):
            self.bus.run_until(self.bus.time + 0.05)
            self.state = self.scene.update()
            self.dragged.publish()
        (shown,) = self.state.references
        return shown


@pytest.fixture
def hands(repository, tmp_path):
    return Hands(repository, tmp_path)


def moved(shown, *by):
    return ScenePose(shown.own.position + by, np.eye(3))


def test_a_dragged_reference_moves_the_hand(hands):
    """The hand follows, as the scene sees it; released it stays."""
    shown = hands.run(0.05)
    before = hands.state.measured["arm1_7"].position
    for _ in range(40):
        assert hands.dragged.drag(shown, "rviz", moved(shown, 0.0, 0.0, 0.05))
        hands.run(0.05)
    after = hands.state.measured["arm1_7"].position
    assert_allclose(after - before, hands.state.measured["torso_2"].rotation @ (0.0, 0.0, 0.05), atol=2e-3)
    hands.dragged.release(shown, "rviz")
    assert not hands.dragged.is_dragged(shown)
    hands.run(0.5)
    assert_allclose(hands.state.measured["arm1_7"].position, after, atol=2e-3)


def test_one_client_drags_until_it_is_silent(hands):
    shown = hands.run(0.05)
    assert not hands.dragged.drag(shown, "first")  # a sign of life begins nothing
    assert hands.dragged.drag(shown, "first", moved(shown, 0.0, 0.0, 0.01))
    assert not hands.dragged.drag(shown, "second", moved(shown, 0.0, 0.0, 0.02))
    hands.dragged.release(shown, "second")
    for _ in range(4):
        hands.run(OPERATOR_SILENCE / 2)
        assert hands.dragged.drag(shown, "first")
    hands.run(OPERATOR_SILENCE + 0.1)
    assert not hands.dragged.is_dragged(shown)
    assert hands.dragged.drag(shown, "second", moved(shown, 0.0, 0.0, 0.02))
