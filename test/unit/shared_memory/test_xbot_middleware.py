"""The middleware in shared memory: topics, services, parameters, reports. Pipes on it: test_pipe_contract.py."""

import gc
import os
import signal
import sys

import numpy as np
import pytest
from support.unit.shared_world import SharedWorld, ask, scale

from solfer.errors import MiddlewareError, UnknownName
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.middleware.shared_memory.topics.sender_segment import SENDER_DEPTH
from solfer.segments import files
from solfer.transport import BodyMessage, JointMessage, MessageStatus
from solfer.transport.messages import (
    JOINT_FIELDS,
    REFUSALS,
    VECTOR_MESSAGES,
    ImuMessage,
    PointsMessage,
    RefusalMessage,
    VectorMessage,
    WrenchMessage,
)

JOINT_STATE, COMMAND = "sensor_msgs/JointState", "solfer/JointCommand"


@pytest.fixture
def world(tmp_path):
    return SharedWorld(tmp_path)


MESSAGES = {
    JOINT_STATE: JointMessage(("a", "b"), position=np.array([1.0, np.nan]), effort=np.array([3.0, -np.inf])),
    "solfer/JointCommand": JointMessage(("a",), **{name: np.array([0.1]) for name in JOINT_FIELDS}),
    "nav_msgs/Odometry": BodyMessage(
        "world",
        "pelvis",
        np.arange(3.0),
        np.arange(4.0),
        np.ones(3),
        -np.ones(3),
        pose_covariance=np.arange(36.0).reshape(6, 6),
        twist_covariance=np.diag(np.arange(6.0)),
    ),
    "sensor_msgs/Imu": ImuMessage("imu_link", np.arange(4.0), np.ones(3), np.full(3, 9.81), (0.1, 0.2, 0.3)),
    "geometry_msgs/WrenchStamped": WrenchMessage("world", np.arange(3.0), np.ones(3)),
    "solfer/RobotPoints": PointsMessage("world", ("left", "right"), np.arange(6.0).reshape(2, 3)),
    REFUSALS: RefusalMessage(("one", "two"), (True, False), ("is not yours", "too \u00e9l\u00e9gant")),
    **{name: VectorMessage("world", np.arange(float(size))) for name, size in VECTOR_MESSAGES.items()},
}


@pytest.mark.parametrize("queued", [False, True], ids=["reader", "queue"])
@pytest.mark.parametrize("kind", MESSAGES)
def test_every_message_arrives_as_it_was_sent(world, kind, queued):
    """Each kind of message, by reader and by queue: all attributes to the bit, with sender, stamp and age."""
    sent = MESSAGES[kind]
    sent.stamp = 12.25
    world.bus.run_until(0.1 + 0.2)
    end = world.node("receiver").queue("t", kind) if queued else world.node("receiver").reader("t", kind)
    world.node("sender").writer("/t", kind).write(sent)
    if queued:
        [received] = end.drain()
    else:
        assert end.read() is MessageStatus.NEW
        received = end.message
        assert end.arrival == world.bus.time and end.age() == 0.0
    assert received.sender == "sender"
    for name, value in vars(sent).items():
        if name != "sender":
            np.testing.assert_array_equal(getattr(received, name), value)
            assert isinstance(value, np.ndarray) or getattr(received, name) == value


def test_a_message_of_joints_without_numbers_arrives(world):
    sender, receiver = world.node("sender"), world.node("receiver")
    reader = receiver.reader("topic", JOINT_STATE)
    sender.writer("topic", JOINT_STATE).write(JointMessage(("a", "b")))
    assert reader.read() is MessageStatus.NEW
    assert reader.message.names == ("a", "b") and reader.message.position is None


def test_no_message_is_lost_at_a_new_layout(world):
    reader = world.node("a").reader("t", JOINT_STATE)
    queue = world.node("b").queue("t", JOINT_STATE)
    writer = world.node("sender").writer("t", JOINT_STATE)
    messages = [
        JointMessage(("a", "b"), position=np.array([1.0, 2.0])),
        JointMessage(("b",), velocity=np.array([3.0])),
        JointMessage(("b", "a"), velocity=np.array([4.0, 5.0])),
    ]
    for message in messages:
        writer.write(message)
        assert reader.read() is MessageStatus.NEW and reader.message.names == message.names
    writer.write(messages[0])
    writer.write(messages[1])
    received = queue.drain()
    assert received[-1].names == ("b",) and received[-1].position is None and received[-1].velocity.tolist() == [3.0]


def test_no_message_is_lost_while_the_sender_changes_its_layout(world, monkeypatch):
    """What comes between a look at the messages and one at the segments would stay in a segment that is left."""
    queue = world.node("b").queue("t", JOINT_STATE)
    writer = world.node("sender").writer("t", JOINT_STATE)
    writer.write(JointMessage(("a",), position=np.array([1.0])))
    assert len(queue.drain()) == 1
    changed = queue._sender_segments.changed

    def sends_first():
        for value, names in ((2.0, ("a",)), (3.0, ("a", "b"))):
            writer.write(JointMessage(names, position=np.full(len(names), value)))
        return changed()

    monkeypatch.setattr(queue._sender_segments, "changed", sends_first)
    writer.write(JointMessage(("a",), position=np.array([1.5])))
    assert [message.position[0] for message in queue.drain()] == [1.5, 2.0, 3.0]


def test_a_full_queue_drops_the_oldest_and_counts(world):
    """What it hands over has the values of its own message, not of the newest one."""
    queue = world.node().queue("t", JOINT_STATE, 3)
    writer = world.node("sender").writer("t", JOINT_STATE)
    for value in range(200):
        writer.write(JointMessage(("a",), position=np.array([float(value)])))
    assert [message.position[0] for message in queue.drain()] == [197.0, 198.0, 199.0]
    assert queue.dropped == 197


def test_pending_reports_messages_that_wait(world):
    """It stays true until all is read, ignores other topics, and sees messages with more joints than before."""
    node = world.node("receiver")
    sender = world.node("sender")
    queues = [node.queue(topic, COMMAND) for topic in ("one", "two")]
    pending = node.pending(queues)
    assert not pending()
    writers = [sender.writer(topic, COMMAND) for topic in ("one", "two", "three")]
    message = JointMessage.empty(("a",), ("position",))
    for _ in range(3):
        for writer, queue in zip(writers, queues, strict=False):
            writer.write(message)
            assert pending() and pending()
            assert len(queue.drain()) == 1
            assert not pending()
        writers[2].write(message)  # a topic that nobody waits for
        assert not pending()
    writers[1].write(JointMessage.empty(("a", "b"), ("position",)))
    assert pending()


def test_only_a_reader_gets_an_earlier_message(world):
    writer = world.node("sender").writer("t", JOINT_STATE)
    writer.write(JointMessage(("a",), position=np.array([1.0])))
    reader = world.node().reader("t", JOINT_STATE)
    queue = world.node().queue("t", JOINT_STATE)
    assert reader.read() is MessageStatus.NEW and queue.drain() == []


def test_a_second_writer_of_one_name_is_refused(world):
    node = world.node("sender")
    node.writer("t", JOINT_STATE)
    with pytest.raises(MiddlewareError, match="writes here already"):
        world.node("sender").writer("t", JOINT_STATE)
    node.close()
    world.node("sender").writer("t", JOINT_STATE)


def test_each_component_of_a_node_has_a_writer(world):
    node = world.node("limbs")
    reader = world.node("a").reader("t", COMMAND)
    queue = world.node("b").queue("/t", COMMAND)
    writers = {name: node.writer(topic, COMMAND) for name, topic in (("drives", "t"), ("springs", "/t"))}
    for name, writer in writers.items():
        writer.write(JointMessage(("a",), position=np.ones(1), component=name))
        assert reader.read() is MessageStatus.NEW and reader.message.claimant == f"limbs#{name}"
    assert [message.claimant for message in queue.drain()] == ["limbs#drives", "limbs#springs"]
    assert "t" in world.node("c").topics().result().published and "t" not in node.topics().result().published
    node.close()
    assert not world.node("c").topics().result().published


def test_a_topic_carries_one_kind_of_message(world):
    world.node("sender").writer("t", JOINT_STATE)
    for make in (world.node().reader, world.node().queue, world.node("other").writer):
        with pytest.raises(MiddlewareError, match="carries sensor_msgs/JointState of 'sender'") as refusal:
            make("t", "nav_msgs/Odometry")
        assert refusal.value.expected == "nav_msgs/Odometry"


def test_waiting_for_a_joint_order_ends(world):
    node = world.node()
    writer = world.node("robot").writer("joint_states", JOINT_STATE)
    world.bus.every(1.0, lambda: writer.write(JointMessage(("a", "b"), position=np.zeros(2))), start=0.5)
    assert node.joint_order("joint_states", "sensor_msgs::JointState", 2.0) == ("a", "b")
    with pytest.raises(MiddlewareError, match="nothing on topic 'empty'"):
        node.joint_order("empty", JOINT_STATE, 0.1)


def test_parameters_are_the_nodes_own_or_the_namespaces(world):
    node = world.node(robot_description="<robot/>")
    assert node.parameter("/robot_description") == "<robot/>"
    with pytest.raises(UnknownName) as caught:
        node.parameter("/robot_descripton", where="a.yaml:3:9")
    assert caught.value.names == ("robot_description",) and caught.value.where == "a.yaml:3:9"
    world.node().provide("/gains/k", [1.5, None, "x"])
    assert node.parameter("gains/k") == [1.5, None, "x"]


def test_a_parameter_ends_with_its_node(world):
    robot = world.node("robot")
    node = world.node()
    robot.provide("/robot_description", "<robot/>")
    with pytest.raises(MiddlewareError, match="writes here already"):
        node.provide("robot_description", "<another/>")
    robot.close()
    with pytest.raises(UnknownName) as caught:
        node.parameter("/robot_description")
    assert caught.value.names == ()
    node.provide("robot_description", "<another/>")
    assert world.node("late").parameter("/robot_description") == "<another/>"


def test_a_parameter_of_a_killed_node_is_not_read(world):
    node = world.node()
    child = os.fork()
    if not child:
        node.provide("robot_description", "<robot/>")
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    assert node.namespace.path("provided", "robot_description").exists()
    with pytest.raises(UnknownName):
        node.parameter("/robot_description")


@pytest.mark.slow
def test_reports_reach_all_nodes(world):
    node = world.node()
    other = world.node("other")
    assert other.reports() == {}
    node.report("arm", 1, "late", {"cycles": 3, "who": "me", "cost": np.float64(0.5)})
    assert other.reports()["arm"].summary == "late"
    node.report("arm", 0, "running", {"cycles": 4})
    report = other.reports()["arm"]
    assert (report.level, report.summary, report.values) == (0, "running", {"cycles": 4.0})
    node.report("leg", 0, "x", {f"figure {index}": "y" * 100 for index in range(1000)})
    assert 10 < len(other.reports()["leg"].values) < 1000


def test_a_second_report_of_one_part_is_dropped(world, caplog):
    world.node().report("arm", 0, "mine", {})
    other = world.node("other")
    for _ in range(3):
        other.report("arm", 2, "not mine", {})
    assert world.node().reports()["arm"].summary == "mine"
    assert len(caplog.records) == 1


def test_the_end_leaves_only_locks_and_latched_files(world, tmp_path):
    server, _ = world.serve(scale)
    client = world.node("client")
    client.writer("t", JOINT_STATE).write(JointMessage(("a",), position=np.zeros(1)))
    client.report("arm", 0, "x", {})
    ask(client)
    assert client.running()
    client.end()
    assert not client.running()
    client.close()
    server.close()
    left = [file for file in tmp_path.rglob("*") if file.is_file() and file.suffix != ".lock"]
    assert sorted(file.name for file in left) == ["bells", "simulated_time"]


def test_a_message_of_very_many_joints_leaves_no_memory(world, tmp_path):
    """Its room is given back with the next layout, and when the writer ends."""

    def size():
        return sum(file.stat().st_blocks * 512 for file in tmp_path.rglob("*") if file.is_file())

    robot = world.node("robot")
    plugin = world.node("plugin")
    reader = plugin.reader("t", JOINT_STATE)
    writer = robot.writer("t", JOINT_STATE)
    few, many = (tuple(f"joint_{number}" for number in range(count)) for count in (2, 20000))
    writer.write(JointMessage(many, position=np.arange(20000.0)))
    assert reader.read() is MessageStatus.NEW and reader.message.names == many
    large = size()
    writer.write(JointMessage(few, position=np.zeros(2)))
    assert reader.read() is MessageStatus.NEW and reader.message.names == few
    assert size() < 0.01 * large
    writer.write(JointMessage(many, position=np.arange(20000.0)))
    robot.close()
    assert size() < 0.01 * large


@pytest.mark.parametrize("name", ["", "a/b", "../x", "a b"])
def test_a_namespace_has_a_plain_name(tmp_path, name):
    with pytest.raises(MiddlewareError, match="invalid namespace name"):
        Namespace(name, tmp_path)


def test_a_folder_that_cannot_be_made(tmp_path):
    with pytest.raises(MiddlewareError, match="cannot be made"):
        Namespace("x", tmp_path / "nowhere")


@pytest.mark.parametrize("topic", ["a/b", ".", "..", "a.lock", "\u00fc ~%", "x" * 80])
def test_any_name_is_a_topic(world, topic):
    reader = world.node().reader(topic, JOINT_STATE)
    world.node("sender").writer(topic, JOINT_STATE).write(JointMessage(("a",), position=np.ones(1)))
    assert reader.read() is MessageStatus.NEW


def test_a_too_long_name_is_an_error(world):
    with pytest.raises(MiddlewareError, match="too long"):
        world.node().reader("x" * 300, JOINT_STATE)


@pytest.mark.slow
def test_ten_thousand_cycles_keep_no_memory(world):
    """Messages, services and reports: Python's allocated blocks must not grow over a long run of the layer."""
    world.serve(scale)
    node = world.node()
    other = world.node("other")
    ends = [
        (node.writer(kind, kind), other.reader(kind, kind), other.queue(kind, kind), MESSAGES[kind])
        for kind in (JOINT_STATE, "nav_msgs/Odometry", "sensor_msgs/Imu", REFUSALS)
    ]

    def cycles(count):
        for cycle in range(count):
            for writer, reader, queue, message in ends:
                writer.write(message)
                assert reader.read() is MessageStatus.NEW and len(queue.drain()) == 1
            node.poll()
            if not cycle % 500:
                node.report("arm", 0, "running", {"cycle": cycle})
                assert other.reports() and ask(other).success

    cycles(1000)
    gc.collect()
    before = sys.getallocatedblocks()
    cycles(10_000)
    gc.collect()
    assert sys.getallocatedblocks() - before < 100


def test_a_notification_is_pending_until_it_is_acknowledged(tmp_path):
    mine, other = (Namespace("x", tmp_path).notification("pipes", "a") for _ in range(2))
    elsewhere = Namespace("x", tmp_path).notification("pipes", "b")
    assert mine.is_pending()  # what was made before it was there has to be found, too
    mine.acknowledge()
    elsewhere.send()
    assert not mine.is_pending()
    other.send()
    assert mine.is_pending() and mine.is_pending()
    mine.acknowledge()
    assert not mine.is_pending()


def test_topics_lists_all_other_nodes(tmp_path):
    """A node's own ends are no peers, nor is a bridge, which only forwards; closed nodes disappear."""
    here, there, bridge = (
        XbotMiddleware(Namespace("topics", tmp_path), name, listens=name != "bridge")
        for name in ("here", "there", "bridge")
    )
    for node in (here, there):
        node.writer("sent", "sensor_msgs/JointState")
        node.queue("desired", "solfer/JointCommand")
    there.reader("velocity_controller/command", "solfer/JointCommand")
    here.reader("mine", "solfer/JointCommand")
    bridge.reader("bridged", "solfer/JointCommand")
    topics = here.topics().result(0)
    assert dict(topics.published) == {"sent": "sensor_msgs/JointState"}
    assert dict(topics.received) == {name: "solfer/JointCommand" for name in ("velocity_controller/command", "desired")}
    there.close()
    topics = here.topics().result(0)
    assert not topics.published and not topics.received


def test_a_reader_of_every_message_keeps_as_many_as_a_sender_does(world):
    writer = world.node("sender").writer("t", JOINT_STATE)
    message = JointMessage(("a",), position=np.zeros(1))
    writer.write(message)
    reader = world.node("receiver").reader("t", JOINT_STATE, 1000)
    for index in range(1, 101):
        message.position[:] = index
        writer.write(message)
    read = []
    while reader.read_next() is not None:
        read.append(float(reader.message.position[0]))
    assert read == list(map(float, range(101 - len(read), 101))) and len(read) in (SENDER_DEPTH - 1, SENDER_DEPTH)
    assert reader.dropped == 101 - len(read) and reader.read_next() is None


def test_a_reader_of_every_message_begins_with_the_newest(world):
    writer = world.node("sender").writer("t", JOINT_STATE)
    message = JointMessage(("a",), position=np.zeros(1))
    for index in range(3):
        message.position[:] = index
        writer.write(message)
    reader = world.node("receiver").reader("t", JOINT_STATE, 8)
    assert reader.read_next().name == "sender" and reader.message.position[0] == 2.0
    assert reader.read_next() is None and reader.dropped == 0


def test_a_reader_of_every_message_drops_senders_that_have_ended(world):
    writer = world.node("sender").writer("t", JOINT_STATE)
    reader = world.node("receiver").reader("t", JOINT_STATE, 8)
    for index in range(6):
        names = ("a", "b")[: 1 + index % 2]  # another segment
        for _ in range(2):
            writer.write(JointMessage(names, position=np.full(len(names), float(index))))
        for _ in range(2):
            assert reader.read_next().name == "sender" and reader.message.names == names
        assert reader.read_next() is None and len(reader._sources) == 1
    assert reader.dropped == 0


def test_a_kill_while_a_parameter_is_set_leaves_nothing(world, monkeypatch):
    """A child is killed before its draft takes its place; the next one that sets the parameter takes the draft away."""
    node = world.node()
    child = os.fork()
    if not child:
        monkeypatch.setattr(files, "replace", lambda *_: os.kill(os.getpid(), signal.SIGKILL))
        node.provide("gain", 1.0)
        os._exit(0)
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGKILL
    folder = node.namespace.path("provided")
    assert [path.name for path in folder.glob("*.new")] == ["gain.new"]
    node.provide("gain", 2.0)
    assert node.parameter("gain") == 2.0 and not [*folder.glob("*.new")]
