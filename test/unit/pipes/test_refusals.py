"""What pipes refuse of a configuration or a message, and which names of a message they use."""

import numpy as np
import pytest
from support.unit.cart import URDF
from support.unit.joint_pipes import RATE, dofs, make_robot, published, received
from support.unit.refusals import check_refusal

from solfer.config.kinds.body import BodyControllerRecord
from solfer.errors import PipeError, UnknownName, Unrelated
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description, Kinematics, Semantics
from solfer.pipes import PipeContext, factory
from solfer.pipes.name_order import NameOrder
from solfer.robot import Robot
from solfer.transport import JointMessage

LINK = dofs(type="body", name="base")
QUATERNION = {"orientation": {"type": "QUATERNION"}}
ANGLES = {"orientation": {"type": "EULER"}}
SPEED = {"velocity": True}
POSE = "geometry_msgs::PoseStamped"
ODOMETRY = "nav_msgs::Odometry"
VECTOR = "geometry_msgs::Vector3Stamped"


def base(**changes):
    """Make the record of a feedback of the base."""
    return received(**{"space": "OPERATIONAL", "dofs": LINK, "function": "state", "message": ODOMETRY} | changes)


def sent(**changes):
    """Make the record of a controller that sends the base."""
    record = {"name": "pipe", "type": "reference", "space": "OPERATIONAL", "dofs": LINK, "function": "state"}
    return BodyControllerRecord.model_validate(record | {"interface": {"position": True}, "sink": "base"} | changes)


def make(record, robot=None):
    """Make the pipe of a record."""
    context = PipeContext(robot or make_robot(), MemoryMiddleware(Bus(), "cart"), {}, RATE)
    return (factory.controller if hasattr(record, "sink") else factory.feedback)(record, context)


REFUSED = [
    (received(source=None), "feedback 'pipe' has no source (expected: source: a topic)"),
    (published(sink=None), "controller 'pipe' has no sink (expected: sink: a topic)"),
    (received(function=None), "feedback 'pipe' has no function (expected: function: state | reference)"),
    (received(interface={}), "pipe 'pipe' carries no interface"),
    (received(message="sensor_msgs::JointState", interface={"stiffness": True}), "carries no 'stiffness'"),
    (published(type="impedance", sink="command"), "the sink 'command' follows the name of the controller 'pipe'"),
    (base(dofs=dofs()), "type 'all' in operational space"),
    (base(dofs=dofs(type="body", name="bse")), "unknown link 'bse' (did you mean base?)"),
    (base(dofs=LINK | {"mapping": "ACTUATED"}), "the map 'ACTUATED' lacks DoFs of the floating base"),
    (base(interface={"position": True, "effort": True}), "carries no 'effort': it carries a link"),
    (base(interface=SPEED, calibrate=True), "is calibrated by the pose that it does not carry"),
    (base(message=POSE, interface=SPEED), "carries no angular and no linear (expected: velocity: false, or another"),
    (base(message="sensor_msgs::Imu"), "carries no position (expected: convention.position.type: NONE, or another"),
    (base(convention=ANGLES), "has no orientation of the type EULER"),
    (base(message=VECTOR, convention=QUATERNION), "has no orientation of the type QUATERNION"),
    (sent(message=POSE, interface=SPEED), "geometry_msgs/PoseStamped carries no 'velocity'"),
    (sent(convention=ANGLES), "nav_msgs/Odometry is sent with a quaternion and a position"),
    (sent(filter={"frequency": 20.0, "damping": 0.8}), "controller 'pipe' filters the state of a link"),
]


@pytest.mark.parametrize(("record", "words"), REFUSED, ids=[words for _, words in REFUSED])
def test_records_that_do_not_fit_are_named(record, words):
    check_refusal(lambda: make(record), UnknownName if "unknown" in words else PipeError, "", words)


def test_a_fixed_robot_has_no_base_to_receive():
    description = Description.from_text(URDF.replace('type="floating"', 'type="fixed"'))
    robot = Robot(Kinematics(description), Semantics.from_text('<robot name="cart"/>', description))
    check_refusal(lambda: make(base(), robot), PipeError, "", f"a floating base, but '{robot.name}' has none")


def test_names_of_a_message_are_compared():
    """Unknown, doubled and missing names are refused; a partial message is accepted, and what is absent is noted."""
    order = NameOrder(("a", "b", "c"), ("d",))
    for call, error, words in (
        (lambda: order.match(("a", "b", "a", "b")), PipeError, "it has joints twice: a, b"),
        (lambda: order.match(("a", "e")), UnknownName, "unknown joint 'e' (expected: one of a, b, c, d)"),
        (lambda: order.match(("d",)), Unrelated, "it has none of the pipe's 3 joints (expected: some of a, b, c)"),
        (lambda: order.require_all(("d", "b")), PipeError, "it lacks the joints a, c (expected: all of a, b, c)"),
    ):
        check_refusal(call, error, "", words)
    order.require_all(("d", "c", "a", "b"))
    assert order.absent() == ["a", "b", "c"]
    assert order.note(order.match(("b", "d"))) and not order.note(order.match(("b",)))
    assert order.absent() == ["a", "c"]
    found = order.match(("d", "c", "a", "b"))
    np.testing.assert_array_equal(found.source, [2, 3, 1])
    assert found.target is None and order.note(found) and order.absent() == []
    order.forget()
    assert order.absent() == ["a", "b", "c"]


def test_joints_that_the_robot_lacks_are_ignored_with_one_warning(caplog):
    """They are in every message, join later, leave again, and stand anywhere in the message."""
    context = PipeContext(make_robot(), MemoryMiddleware(Bus(), "cart"), {}, RATE)
    pipe = factory.feedback(received(dofs=dofs(type="actuated"), function="state"), context)
    writer = context.middleware.writer("joints", "solfer/JointCommand")
    messages = [
        ("roll", "shoulder"),
        ("finger", "roll", "shoulder"),
        ("roll", "thumb", "shoulder", "finger"),
        ("roll",),
    ]
    for count, names in enumerate(messages * 2, 1):
        writer.write(JointMessage(names, np.array([0.01 * count if name == "roll" else 0.0 for name in names])))
        pipe.run()
        assert pipe.accepted == count and context.robot.state.position[6] == 0.01 * count
    assert [record.message for record in caplog.records if "ignored" in record.message] == [
        "the robot has no joint 'finger': ignored in messages",
        "the robot has no joint 'thumb': ignored in messages",
    ]


def test_a_misspelt_joint_is_refused():
    """It is like one that the message lacks; beside that one it is another joint."""
    order = NameOrder(("shoulder", "elbow"), (), ignores=True)
    check_refusal(lambda: order.match(("shuolder", "elbow")), UnknownName, "", "'shuolder'")
    assert order.match(("shuolder", "shoulder", "elbow")).source.tolist() == [1, 2]
