"""The bridge with one end in shared memory; the other one is a bus."""

import numpy as np
import pytest
from support.shared_memory.xbot_bridge import made

from solfer.components.move_joints import MoveJoints, Reply
from solfer.errors import MiddlewareError
from solfer.interfaces.declaration import Service
from solfer.middleware.bridge import Route
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.middleware.shared_memory.discovery import published_topics, services
from solfer.transport.endpoints import MessageStatus
from solfer.transport.inbox import Inbox
from solfer.transport.messages import ROBOT_POINTS, BodyMessage, JointMessage, PointsMessage

INWARDS = [Route("commands", "solfer/JointCommand"), Route("goals", ROBOT_POINTS)]


class BridgedNodes:
    """A node in shared memory, one on a bus, and the bridge between them."""

    def __init__(self, folder):
        self.namespace, self.bus = Namespace("test", folder), Bus()
        self.rt, self.nrt = XbotMiddleware(self.namespace, "rt"), MemoryMiddleware(self.bus, "nrt")
        self._end = XbotMiddleware(self.namespace, "bridge")
        self.bridge = made(self.namespace, self._end, MemoryMiddleware(self.bus, "bridge"), INWARDS, [])

    def turn(self, duration=0.005):
        """Run a cycle of the bridge, `duration` [s] later on the bus."""
        self.bus.run_until(self.bus.time + duration)
        self.bridge.cycle()

    def close(self):
        self.rt.close()
        self._end.close()


@pytest.fixture
def layer(tmp_path):
    layer = BridgedNodes(tmp_path)
    yield layer
    layer.close()


def test_joints_and_points_go_in(layer):
    joints, points = layer.rt.reader("commands", "solfer/JointCommand"), layer.rt.reader("goals", ROBOT_POINTS)
    layer.nrt.writer("commands", "solfer/JointCommand").write(JointMessage(("a", "b"), position=np.array([1.0, 2.0])))
    layer.nrt.writer("goals", ROBOT_POINTS).write(PointsMessage("world", ("hand",), np.array([[1.0, 2.0, 3.0]])))
    layer.turn()
    assert joints.read() is MessageStatus.NEW and points.read() is MessageStatus.NEW
    assert (joints.message.names, joints.message.position.tolist()) == (("a", "b"), [1.0, 2.0])
    assert (points.message.names, points.message.values.tolist()) == (("hand",), [[1.0, 2.0, 3.0]])


def test_a_later_body_is_forwarded_without_a_circle(layer):
    received = layer.nrt.reader("hand", "nav_msgs/Odometry")
    layer.nrt.writer("commands", "solfer/JointCommand").write(JointMessage(("a",), position=np.array([1.0])))
    layer.turn()
    writer = layer.rt.writer("hand", "nav_msgs/Odometry")
    layer.turn(1.0)
    writer.write(BodyMessage("world", "arm1_7", position=np.array([1.0, 2.0, 3.0])))
    layer.turn()
    assert received.read() is MessageStatus.NEW
    assert received.message.position.tolist() == [1.0, 2.0, 3.0]
    assert layer.bridge.crossings["commands"].passed == 1
    layer.turn(1.0)
    assert layer.bridge.crossings["commands"].passed == 1


def test_known_topics_and_services_are_left_out(layer):
    layer.rt.writer("hand", "nav_msgs/Odometry").write(BodyMessage("world", "arm1_7"))
    layer.rt.serve("arm", [Service("trajectory", "solfer/MoveJoints", MoveJoints, Reply, Reply)], Inbox().submit)
    assert {each.topic for each in published_topics(layer.namespace)} == {"hand", "goals", "commands"}
    assert [each.name for each in services(layer.namespace)] == ["arm/trajectory"]
    assert [each.topic for each in published_topics(layer.namespace, {"hand", "goals"})] == ["commands"]
    assert not services(layer.namespace, {"arm/trajectory"})


def test_a_service_of_the_layer_answers_outside(layer):
    """The request arrives with every field, and the reply of the layer's inbox returns over the bridge."""
    inbox, received = Inbox(), []

    def move(request):
        received.append(request)
        return Reply(duration=2.5)

    layer.rt.serve("arm", [Service("trajectory", "solfer/MoveJoints", MoveJoints, Reply, move)], inbox.submit)
    layer.turn(1.0)
    answer = layer.bus.call("arm/trajectory", state="home", joints=("a",), positions=(0.5,), velocities=(), speed=1.0)
    for _ in range(5):
        layer.turn()
        layer.rt.poll()
        inbox.apply()
    assert answer.result(0).duration == 2.5
    assert received == [MoveJoints("home", ("a",), (0.5,), (), 1.0)]


def test_an_ended_service_is_unavailable(layer):
    inbox = Inbox()
    node = XbotMiddleware(layer.namespace, "arm")
    node.serve("arm", [Service("trajectory", "solfer/MoveJoints", MoveJoints, Reply, Reply, timeout=0.1)], inbox.submit)
    layer.turn(1.0)
    node.close()
    answer = layer.bus.call("arm/trajectory", state="home", joints=(), positions=(), velocities=(), speed=0.0)
    end = layer.rt.now() + 30.0
    while not answer.done() and layer.rt.now() < end:
        layer.turn()
    with pytest.raises(MiddlewareError, match="no node offers the service 'arm/trajectory'"):
        answer.result(0)


def test_health_goes_out_once(layer):
    layer.rt.report("xbot", 1, "one cycle too long", {"cycles": 5})
    layer.turn(2.0)
    assert layer.bus.reports["xbot"].summary == "one cycle too long"
    layer.bus.reports.clear()
    layer.turn(2.0)
    assert "xbot" not in layer.bus.reports
    assert "xbot_bridge" in layer.bus.reports
