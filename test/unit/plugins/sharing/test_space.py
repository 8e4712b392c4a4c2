"""Tests of the shared space: what members publish is there for the others, and for nobody twice."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from solfer.errors import PipeError, SolferErrors
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins.sharing.member import SpaceMember
from solfer.plugins.sharing.space import SharedSpace, SharedTopic
from solfer.transport import MessageStatus
from solfer.transport.health import Health
from solfer.transport.lower_level import Answer
from solfer.transport.messages import JointMessage, VectorMessage
from solfer.transport.middleware import NoFields

JOINTS = "sensor_msgs/JointState"
VECTOR = "geometry_msgs/Vector3Stamped"


@pytest.fixture
def bus():
    return Bus()


@pytest.fixture
def space():
    return SharedSpace([SharedTopic("first", "desired", JOINTS, "a.yaml:1:1"), SharedTopic("second", "force", VECTOR)])


def member(name, space, bus):
    return SpaceMember(name, space, MemoryMiddleware(bus, "node"))


def joints(*position):
    return JointMessage(("a", "b"), position=np.array(position, dtype=float))


def test_next_component_has_it_at_once(space, bus):
    reader = member("second", space, bus).reader("/desired", JOINTS)
    writer = member("first", space, bus).writer("desired", JOINTS)
    assert reader.read() is MessageStatus.NONE and not reader.update()
    bus.run_until(0.5)
    writer.write(joints(1.0, 2.0))
    assert reader.read() is MessageStatus.NEW and reader.arrival == 0.5
    assert_array_equal(reader.message.position, (1.0, 2.0))
    assert reader.message.sender == "first" and [each.name for each in reader.update()] == ["first"]
    assert reader.read() is MessageStatus.OLD
    bus.run_until(0.75)
    assert reader.age() == 0.25


def test_what_is_received_stays_until_the_next(space, bus):
    reader = member("second", space, bus).reader("desired", JOINTS)
    writer = member("first", space, bus).writer("desired", JOINTS)
    message = joints(1.0, 2.0)
    writer.prepare(message)
    writer.write(message)
    message.position[:] = np.nan  # as in a cycle whose command is refused
    assert reader.read() is MessageStatus.NEW
    assert_array_equal(reader.message.position, (1.0, 2.0))
    message.position[:] = 3.0, 4.0
    message.stamp = 7.0
    writer.write(message)
    assert reader.read() is MessageStatus.NEW and reader.message.stamp == 7.0
    assert_array_equal(reader.message.position, (3.0, 4.0))


def test_everybody_else_receives_it_as_before(space, bus):
    outside = MemoryMiddleware(bus, "outside").reader("desired", JOINTS)
    member("first", space, bus).writer("desired", JOINTS).write(joints(1.0, 2.0))
    assert outside.read() is MessageStatus.NEW and outside.message.sender == "node"
    assert_array_equal(outside.message.position, (1.0, 2.0))


def test_others_on_a_shared_topic_do_not_count(space, bus):
    reader = member("second", space, bus).reader("desired", JOINTS)
    MemoryMiddleware(bus, "outside").writer("desired", JOINTS).write(joints(9.0, 9.0))
    assert reader.read() is MessageStatus.NONE


def test_topics_of_others_come_from_the_middleware(space, bus):
    reader = member("first", space, bus).reader("elsewhere", JOINTS)
    MemoryMiddleware(bus, "outside").writer("elsewhere", JOINTS).write(joints(5.0, 6.0))
    assert reader.read() is MessageStatus.NEW and reader.message.sender == "outside"


@pytest.mark.parametrize("separately", [False, True], ids=["of all", "of each publisher"])
def test_nobody_receives_its_own(space, bus, separately):
    """A member that reads and writes a topic sees others only, and its own messages do not make it NEW."""
    this = member("first", space, bus)
    reader, writer = this.reader("desired", JOINTS), this.writer("desired", JOINTS)
    outside = MemoryMiddleware(bus, "outside").writer("desired", JOINTS)

    def read():
        if not separately:
            return [reader.read()]
        return [reader.read_from(each) for each in reader.update()] or [MessageStatus.NONE]

    writer.write(joints(1.0, 2.0))
    assert read() == [MessageStatus.NONE] and reader.message is None
    outside.write(joints(3.0, 4.0))
    writer.write(joints(5.0, 6.0))
    assert read() == [MessageStatus.NEW]
    assert_array_equal(reader.message.position, (3.0, 4.0))
    assert [each.name for each in reader.update()] == ["outside"]
    writer.write(joints(7.0, 8.0))
    assert read() == [MessageStatus.OLD]


def test_message_of_another_type_is_another_channel(space, bus):
    assert member("first", space, bus).reader("force", VECTOR).carries == ""
    other = SharedSpace([SharedTopic("second", "force", JOINTS)])
    assert member("first", other, bus).reader("force", VECTOR).carries == VECTOR


def test_two_publishers_of_a_topic_are_refused():
    twice = [SharedTopic("first", "t", JOINTS, "a.yaml:1:2"), SharedTopic("second", "t", VECTOR, "a.yaml:3:4")]
    with pytest.raises((PipeError, SolferErrors), match="a.yaml:3:4: 'first' .a.yaml:1:2. and 'second' both publish"):
        SharedSpace(twice)


def test_order_of_joints_is_known_before_messages(space, bus):
    writer = member("first", space, bus).writer("desired", JOINTS)
    writer.prepare(joints(0.0, 0.0))
    assert member("second", space, bus).joint_order("desired", JOINTS, 1.0) == ("a", "b")
    assert bus.time == 0.0


def test_a_message_made_anew_each_time_is_copied(space, bus):
    reader = member("first", space, bus).reader("force", VECTOR)
    writer = member("second", space, bus).writer("force", VECTOR)
    for value in (1.0, 2.0):
        message = VectorMessage("world", np.full(3, value))
        writer.write(message)
        message.values[:] = -1.0
        assert reader.read() is MessageStatus.NEW
        assert_array_equal(reader.message.values, np.full(3, value))


@pytest.mark.parametrize(
    ("method", "question"),
    [
        ("call", ("scaler/scale", "test/Scale", NoFields(), Answer, 0.5)),
        ("request", ("scaler/scale", "test/Scale", NoFields(), Answer, 0.5)),
        ("controller_joints", ("legs", 0.5, "a.yaml:1:1")),
        ("controller_gains", ("legs", 0.5, "a.yaml:1:1")),
        ("_first_order", ("elsewhere", JOINTS, 0.5)),
        ("serve", ("scaler", (), print)),
        ("report", ("arm", Health.GOOD, "running", {"cycles": 1.0})),
    ],
)
def test_what_is_not_shared_goes_on_unchanged(space, bus, monkeypatch, method, question):
    asked = []
    monkeypatch.setattr(MemoryMiddleware, method, lambda _, *question: asked.append(question))
    getattr(member("first", space, bus), method)(*question)
    assert asked == [question]


def test_every_message_of_others_is_kept(space, bus):
    reader = member("first", space, bus).reader("desired", JOINTS, 2)
    own = member("first", space, bus).writer("desired", JOINTS)
    outside = MemoryMiddleware(bus, "outside").writer("desired", JOINTS)
    for value in (1.0, 2.0, 3.0):
        outside.write(joints(value, value))
        own.write(joints(0.0, 0.0))
    for value in (2.0, 3.0):
        assert reader.read_next().name == "outside"
        assert_array_equal(reader.message.position, (value, value))
    assert reader.read_next() is None and reader.dropped >= 1


def test_what_a_component_publishes_once_a_cycle_is_read_once(space, bus):
    reader = member("second", space, bus).reader("desired", JOINTS, 2)
    assert reader.read_next() is None
    member("first", space, bus).writer("desired", JOINTS).write(joints(1.0, 2.0))
    assert reader.read_next().name == "first" and reader.read_next() is None
