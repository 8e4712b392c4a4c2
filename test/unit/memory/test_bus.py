"""The memory middleware: order, copies, clock."""

import math

import numpy as np
import pytest
from support.unit.shared_world import Scale, Scaled, scale

from solfer.components import Service
from solfer.errors import ComponentError, MiddlewareError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import Inbox, JointMessage, MessageStatus

JOINT_STATE = "sensor_msgs/JointState"


@pytest.fixture
def bus():
    return Bus({"/robot_description": "<robot/>"})


def message(value=0.0):
    return JointMessage(("a", "b"), position=np.full(2, value))


def test_a_reader_returns_none_new_or_old(bus):
    writer = MemoryMiddleware(bus, "robot").writer("joint_states", JOINT_STATE)
    reader = MemoryMiddleware(bus).reader("/joint_states", JOINT_STATE)
    assert reader.read() is MessageStatus.NONE and reader.age() == math.inf
    writer.write(message(1.0))
    assert reader.read() is MessageStatus.NEW and reader.message.sender == "robot"
    assert reader.read() is MessageStatus.OLD
    bus.run_until(0.25)
    assert reader.age() == pytest.approx(0.25)


def test_a_sent_message_is_a_copy(bus):
    node = MemoryMiddleware(bus)
    reader, sent = node.reader("t", JOINT_STATE), message(1.0)
    node.writer("t", JOINT_STATE).write(sent)
    sent.position[:] = 9.0
    reader.read()
    assert reader.message.position.tolist() == [1.0, 1.0]


def test_a_queue_keeps_order_and_counts_drops(bus):
    node = MemoryMiddleware(bus)
    queue, writer = node.queue("t", JOINT_STATE, size=3), node.writer("t", JOINT_STATE)
    for value in range(5):
        writer.write(message(float(value)))
    assert [item.position[0] for item in queue.drain()] == [2.0, 3.0, 4.0]
    assert queue.dropped == 2 and queue.drain() == []


def test_a_topic_carries_one_kind_of_message(bus):
    node = MemoryMiddleware(bus)
    node.reader("t", JOINT_STATE)
    with pytest.raises(MiddlewareError, match="carries sensor_msgs/JointState"):
        node.writer("t", "nav_msgs/Odometry")


def test_work_is_done_in_order_without_drift(bus):
    done = []
    bus.every(0.001, lambda: done.append(("fast", bus.time)))
    bus.every(0.005, lambda: done.append(("slow", bus.time)))
    bus.run_until(1.0)
    slow = [time for name, time in done if name == "slow"]
    assert len(slow) == 200 and slow[-1] == 199 * 0.005
    assert [name for name, _ in done[:7]] == ["fast", "slow", "fast", "fast", "fast", "fast", "fast"]
    assert bus.time == 1.0


def test_what_is_due_at_one_time_comes_in_order(bus):
    """Multiples of two periods differ in their last bits: a plugin would read this step's measurements or the last."""
    steps = []
    ages = []
    bus.run_until(0.1 + 0.2)
    bus.every(0.001, lambda: steps.append(bus.time))
    bus.every(0.005, lambda: ages.append(bus.time - steps[-1]))
    bus.run_until(20.0)
    assert max(ages) == 0.0


def test_an_unknown_parameter_error_names_the_nearest(bus):
    node = MemoryMiddleware(bus)
    assert node.parameter("robot_description") == "<robot/>"
    with pytest.raises(UnknownName) as caught:
        node.parameter("/robot_descripton", where="a.yaml:3:9")
    assert caught.value.names == ("/robot_description",) and str(caught.value).startswith("a.yaml:3:9: ")


def test_a_call_is_answered_between_cycles(bus):
    """A handler must not run amid a cycle: replies, refusals and misspelt names come when the inbox is applied."""
    inbox = Inbox("not running yet")

    def handler(request):
        if request["x"] < 0:
            raise ComponentError("x is negative")
        return {"success": True, "y": 2 * request["x"]}

    service = Service("double", "test/Double", dict, dict, handler)
    MemoryMiddleware(bus).serve("node", [service], inbox.submit)
    early = bus.call("node/double", x=1)
    inbox.apply()
    with pytest.raises(MiddlewareError, match="not running yet"):
        early.result(0)
    inbox.refusal = ""
    good, bad = bus.call("node/double", x=2), bus.call("node/double", x=-1)
    assert not good.done()
    inbox.apply()
    assert good.result(0)["y"] == 4
    assert bad.result(0) == {"success": False, "message": "x is negative"}
    with pytest.raises(UnknownName) as caught:
        bus.call("node/duoble", x=1)
    assert caught.value.names == ("node/double",)


def test_a_call_lasts_until_its_answer(bus):
    inbox, node = Inbox(), MemoryMiddleware(bus)
    service = Service("scale", "test/Scale", Scale, Scaled, scale)
    MemoryMiddleware(bus, "server").serve("scaler", [service], inbox.submit)
    question = "scaler/scale", "test/Scale", Scale((1.0, 2.0), 3.0), Scaled, 0.5
    with pytest.raises(MiddlewareError, match="'scaler/scale' did not answer within 0.5 s"):
        node.call(*question)
    assert bus.time == pytest.approx(0.5, abs=2e-3)
    bus.every(1.0, inbox.apply, start=0.6)
    assert node.call(*question).numbers == (3.0, 6.0)
    assert bus.time == pytest.approx(0.6, abs=2e-3)


def test_waiting_for_a_joint_order_ends(bus):
    node = MemoryMiddleware(bus)
    writer = node.writer("joint_states", JOINT_STATE)
    bus.every(1.0, lambda: writer.write(message()), start=0.5)
    assert node.joint_order("joint_states", JOINT_STATE, 2.0) == ("a", "b")
    assert node.joint_order("joint_states", "sensor_msgs::JointState", 2.0) == ("a", "b")
    with pytest.raises(MiddlewareError, match="nothing on topic 'empty'"):
        node.joint_order("empty", JOINT_STATE, 0.1)


def test_a_closed_node_leaves_nothing(bus):
    """Topics and services of a closed node are free for its successor, but a message on its way still arrives."""
    service = Service("double", "test/Double", dict, dict, lambda request: request)
    first, other = MemoryMiddleware(bus, "first"), MemoryMiddleware(bus, "other")
    first.serve("node", [service], Inbox().submit)
    writer, reader = first.writer("sent", JOINT_STATE), other.reader("sent", JOINT_STATE)
    first.reader("received", JOINT_STATE)
    other.writer("received", JOINT_STATE)
    writer.write(message(1.0))
    assert bus.topics(other).published == {"sent": JOINT_STATE}
    first.close()
    assert bus.topics(other).published == {} and bus.topics(other).received == {}
    assert bus.topics(first).published == {"received": JOINT_STATE}
    assert reader.read() is MessageStatus.NEW
    with pytest.raises(UnknownName):
        bus.call("node/double")
    MemoryMiddleware(bus, "first").serve("node", [service], Inbox().submit)
