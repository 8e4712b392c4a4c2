"""The bridge between two middlewares, here two buses with a clock of their own."""

from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from support.unit.declarations import COUNT, CountGoal, CountingNode, counting_client

from solfer.config import load
from solfer.errors import MiddlewareError
from solfer.interfaces.declaration import Service
from solfer.middleware.bridge import Bridge, BridgeSearch, Route, ServiceForward, routes
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport.declared import GoalStatus
from solfer.transport.declared.goals import GOAL_ID
from solfer.transport.endpoints import MessageStatus
from solfer.transport.inbox import Inbox
from solfer.transport.messages import BodyMessage, JointMessage

JOINTS = Route("desired", "solfer/JointCommand")
BODY = Route("hand", "nav_msgs/Odometry")


@dataclass(frozen=True)
class Question:
    """A request."""

    number: float


@dataclass(frozen=True)
class Reply:
    """Its reply."""

    success: bool = True
    message: str = ""


ASK = ServiceForward("arm/ask", "package/Ask", Question, Reply, timeout=1.0)


class Sides:
    """A real-time side, another side, and the bridge between them."""

    def __init__(self, **search):
        self.buses = Bus(), Bus()
        self.rt, self.nrt = MemoryMiddleware(self.buses[0], "rt"), MemoryMiddleware(self.buses[1], "nrt")
        ends = (MemoryMiddleware(bus, "bridge") for bus in self.buses)
        self.bridge = Bridge(*ends, [JOINTS], [BODY], BridgeSearch(**search))

    def turn(self, count=1):
        """Run cycles of the bridge, 5 ms each on both sides."""
        for _ in range(count):
            for bus in self.buses:
                bus.run_until(bus.time + 0.005)
            self.bridge.cycle()


def command(position):
    return JointMessage(("a", "b"), position=np.array(position), stamp=3.5)


@pytest.mark.slow
def test_a_topic_goes_in_whole():
    sides = Sides()
    reader = sides.rt.reader("desired", "solfer/JointCommand")
    sides.nrt.writer("desired", "solfer/JointCommand").write(command([1.0, 2.0]))
    sides.turn()
    assert reader.read() is MessageStatus.NEW
    assert reader.message.names == ("a", "b")
    assert reader.message.position.tolist() == [1.0, 2.0]
    assert reader.message.velocity is None
    assert reader.message.stamp == 3.5
    assert reader.message.sender == "bridge"


def test_a_topic_goes_out_whole():
    sides = Sides()
    reader = sides.nrt.reader("hand", "nav_msgs/Odometry")
    message = BodyMessage("world", "arm1_7", position=np.array([1.0, 2.0, 3.0]))
    sides.rt.writer("hand", "nav_msgs/Odometry").write(message)
    sides.turn()
    assert reader.read() is MessageStatus.NEW
    assert (reader.message.frame, reader.message.child) == ("world", "arm1_7")
    assert reader.message.position.tolist() == [1.0, 2.0, 3.0]


def test_only_the_newest_message_is_forwarded():
    sides = Sides()
    queue = sides.rt.queue("desired", "solfer/JointCommand")
    writer = sides.nrt.writer("desired", "solfer/JointCommand")
    for number in range(100):
        writer.write(command([number, 0.0]))
    sides.turn()
    assert [message.position[0] for message in queue.drain()] == [99.0]
    crossing = sides.bridge.crossings["desired"]
    assert (crossing.passed, crossing.dropped) == (1, 99)


def test_nothing_is_forwarded_without_news():
    sides = Sides()
    reader = sides.rt.reader("desired", "solfer/JointCommand")
    sides.nrt.writer("desired", "solfer/JointCommand").write(command([1.0, 2.0]))
    sides.turn(21)
    assert reader.read() is MessageStatus.NEW
    assert reader.age() == pytest.approx(0.1)


def test_a_message_that_is_refused_stops_nothing(monkeypatch):
    """The other end's pipe belongs to another process for a moment: that is counted, and the next message passes."""
    sides = Sides()
    crossing = sides.bridge.crossings["desired"]

    def refuse(_message):
        raise MiddlewareError("another process writes this pipe")

    writer = sides.nrt.writer("desired", "solfer/JointCommand")
    with monkeypatch.context() as patch:
        patch.setattr(crossing._writer, "write", refuse)
        writer.write(command([1.0, 2.0]))
        sides.turn()
    assert (crossing.passed, crossing.refused) == (0, 1)
    sides.turn(201)
    assert sides.buses[1].reports["xbot_bridge"].values["messages refused"] == 1
    writer.write(command([1.0, 2.0]))
    sides.turn()
    assert (crossing.passed, crossing.refused) == (1, 1)


def serve(sides, handler, inbox):
    sides.rt.serve("arm", [Service("ask", "package/Ask", Question, Reply, handler)], inbox.submit)


def test_a_request_is_carried_out_inside():
    sides, inbox, received = Sides(offers=lambda known: [ASK]), Inbox(), []
    serve(sides, lambda request: received.append(request) or Reply(message="done"), inbox)
    sides.turn()
    answer = sides.buses[1].call("arm/ask", number=2.5)
    sides.turn()
    assert not answer.done()
    inbox.apply()
    sides.turn()
    assert answer.result(0) == Reply(message="done")
    assert received == [Question(2.5)]


def test_a_refusal_inside_is_the_reply_outside():
    sides, inbox = Sides(offers=lambda known: [ASK]), Inbox("plugin 'arm' has stopped")
    serve(sides, lambda request: Reply(), inbox)
    sides.turn()
    answer = sides.buses[1].call("arm/ask", number=2.5)
    sides.turn()
    inbox.apply()
    sides.turn()
    with pytest.raises(MiddlewareError, match="plugin 'arm' has stopped"):
        answer.result(0)


def test_a_gone_service_is_unavailable():
    sides = Sides(offers=lambda known: [ASK])
    sides.turn()
    answer = sides.buses[1].call("arm/ask", number=2.5)
    sides.turn()
    with pytest.raises(MiddlewareError, match="no node offers the service 'arm/ask'"):
        answer.result(0)


def test_a_service_that_comes_later_is_offered():
    offers = []
    sides = Sides(offers=lambda known: offers)
    sides.turn()
    with pytest.raises(LookupError):
        sides.buses[1].call("arm/ask", number=2.5)
    offers.append(ASK)
    sides.turn(101)
    assert isinstance(sides.buses[1].call("arm/ask", number=2.5), Future)


def test_requests_that_wait_at_the_end_are_cancelled():
    sides = Sides(offers=lambda known: [ASK])
    sides.turn()
    answer = sides.buses[1].call("arm/ask", number=2.5)
    sides.bridge.close()
    assert answer.cancelled()


def test_a_topic_that_comes_later_goes_out():
    found = []
    sides = Sides(topics=lambda known: found)
    sides.turn()
    found.append(Route("joint_states", "sensor_msgs/JointState"))
    sides.turn(101)
    reader = sides.nrt.reader("joint_states", "sensor_msgs/JointState")
    sides.rt.writer("joint_states", "sensor_msgs/JointState").write(command([1.0, 2.0]))
    sides.turn()
    assert reader.read() is MessageStatus.NEW


def test_known_offers_are_not_searched_again():
    asked = []

    def found(known, new):
        asked.append(set(known))
        return [] if new.name in known else [new]

    sides = Sides(offers=lambda known: found(known, ASK))
    sides.turn(250)
    assert asked == [set(), {"arm/ask"}, {"arm/ask"}]


def test_the_report_counts_what_went_each_way():
    sides = Sides()
    sides.nrt.writer("desired", "solfer/JointCommand").write(command([1.0, 2.0]))
    sides.turn(202)
    report = sides.buses[1].reports["xbot_bridge"]
    assert (report.level, report.summary) == (0, "running")
    assert report.values["in desired"] == "1 passed, 0 dropped"
    assert report.values["out hand"] == "0 passed, 0 dropped"


MAIN = """
mwoibn:
  middleware: XBOT
  system: SM
  layers: {{RT: {{file: RT.yaml}}}}
  robot:
    name: cart
    systems: {{SM: {{file: SM.yaml}}}}
    joints: {{feedback: {{list: [measured, goal]}}, actuators: {{read: false}}, contacts: {{read: false}}}}
  feedback:
    measured: {{space: JOINT, dofs: &all {{chain: all, type: all, mapping: RBDL}}, interface: &both {{position: true}},
               function: state}}
    goal: {{space: JOINT, dofs: *all, interface: *both, function: reference}}
  controller:
    out: {{space: JOINT, type: reference, dofs: *all, interface: *both, function: state}}
  xbot:
    source: {{urdf: /robot_description}}
    feedback:
      measured: {{source: joint_states, layer: lower_level}}
      goal: {{source: /desired, layer: NRT}}
    controller:
      out: {{sink: {sink}, layer: NRT, message: sensor_msgs/JointState}}
  modules:
    cart: {{layer: RT, robot: joints, mode: full, controller: [out], kinematics: true, dynamics: false,
           model_change: false}}
"""


def written(tmp_path: Path, sink: str):
    (tmp_path / "main.yaml").write_text(MAIN.format(sink=sink))
    (tmp_path / "RT.yaml").write_text("mwoibn: {robot: {rate: 500}}\n")
    (tmp_path / "SM.yaml").write_text("mwoibn: {}\n")
    return load(tmp_path / "main.yaml", "cart")


def test_routes_are_the_pipes_to_the_other_layer(tmp_path):
    inwards, outwards = routes([written(tmp_path, "posture")])
    assert inwards == [Route("desired", "solfer/JointCommand")]
    assert outwards == [Route("posture", "sensor_msgs/JointState")]


@pytest.mark.parametrize(
    ("plugins", "expected"),
    [
        (("lower_body", "whole_body"), [Route("upper_body", "solfer/JointCommand")]),
        (("whole_body",), [Route("upper_body", "solfer/JointCommand"), Route("lower_body", "solfer/JointCommand")]),
        (("upper_body", "lower_body", "whole_body"), []),
        (("joint_states",), []),
    ],
)
def test_topics_without_a_publisher_inside_come_from_outside(repository, plugins, expected):
    main = repository / "config/centauro.yaml"
    assert routes([load(main, name, middleware="XBOT", layer="RT") for name in plugins]) == (expected, [])


def test_a_topic_cannot_cross_in_both_directions(tmp_path):
    with pytest.raises(MiddlewareError, match="topic 'desired' would cross the border in both directions"):
        routes([written(tmp_path, "desired")])


def test_an_action_of_the_layer_is_used_outside():
    """Goals, cancels, feedback and results cross the bridge both ways, also when a goal is preempted by the next."""
    inwards = [Route("abacus/count/goal", f"{COUNT}ActionGoal"), Route("abacus/count/cancel", GOAL_ID)]
    outwards = [Route(f"abacus/count/{part}", f"{COUNT}Action{part.title()}") for part in ("feedback", "result")]
    sides = Sides(topics=lambda known: outwards, requested=lambda known: inwards)
    node, client = CountingNode(sides.rt), counting_client(sides.nrt)
    sides.turn()
    first = client.send(CountGoal(1000))
    for _ in range(3):
        sides.turn()
        node.cycle()
    second = client.send(CountGoal(2))
    client.cancel(first)
    for _ in range(8):
        sides.turn()
        node.cycle()
        client.poll()
    assert first.status is GoalStatus.PREEMPTED and first.feedback.count > 0
    assert second.status is GoalStatus.SUCCEEDED and second.result.count == 2
