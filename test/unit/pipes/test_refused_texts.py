"""What pipes say of a configuration or a message that does not fit, word for word."""

import numpy as np
import pytest
from support.unit.cart import URDF
from support.unit.joint_pipes import RATE, dofs, make_robot, published, received

from solfer.config.kinds.body import BodyControllerRecord
from solfer.config.records.pipes import InterfaceRecord
from solfer.errors import SolferError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description, Kinematics, Semantics
from solfer.pipes import PipeContext, factory
from solfer.pipes.context import fields_of
from solfer.pipes.name_order import NameOrder
from solfer.robot import Robot
from solfer.transport import JointMessage

BASE = {"space": "OPERATIONAL", "dofs": dofs(type="body", name="base"), "message": None, "function": "state"}
QUATERNION = {"orientation": {"type": "QUATERNION"}}
ANGLES = {"orientation": {"type": "EULER"}}
ANOTHER = ", or another message"


def base(**changes):
    """Make the record of a feedback of the base."""
    record = {**BASE, **changes}
    return received(**{key: value for key, value in record.items() if value is not None})


def sent(**changes):
    """Make the record of a controller that sends the base."""
    record = {"name": "pipe", "type": "reference", **BASE, "interface": {"position": True}, "sink": "base", **changes}
    return BodyControllerRecord.model_validate({key: value for key, value in record.items() if value is not None})


REFUSED = [
    (received(source=None), "feedback 'pipe' has no source|source: a topic"),
    (published(sink=None), "controller 'pipe' has no sink|sink: a topic"),
    (received(function=None), "feedback 'pipe' has no function|function: state | reference"),
    (received(interface={}), "pipe 'pipe' carries no interface|at least one true"),
    (
        received(message="sensor_msgs::JointState", interface={"stiffness": True}),
        "sensor_msgs/JointState carries no 'stiffness'|solfer/JointCommand, or of position, velocity, effort",
    ),
    (
        published(type="impedance", sink="command"),
        "the sink 'command' follows the name of the controller 'pipe' without a slash|/command",
    ),
    (
        published(type="velocity", sink=None, interface={"velocity": True, "effort": True}),
        "the lower level's controller 'pipe' takes no 'effort'|of velocity",
    ),
    (
        received(dofs=dofs(type="unactuated", mapping="ACTUATED")),
        "pipe 'pipe' carries no DoF: none of chain 'all', type 'unactuated' is in map 'ACTUATED'|",
    ),
    (base(dofs=dofs()), "type 'all' in operational space|type: body, with the key 'name', a link"),
    (base(dofs=dofs(type="body", name="bse")), "unknown link 'bse'||base"),
    (
        base(dofs=dofs(type="body", name="base", mapping="ACTUATED")),
        "the map 'ACTUATED' lacks DoFs of the floating base|a map with all DoFs, such as 'RBDL'",
    ),
    (
        base(interface={"position": True, "effort": True}),
        "pipe 'pipe' carries no 'effort': it carries a link|effort: false",
    ),
    (
        base(message="nav_msgs::Odometry", interface={"velocity": True}, calibrate=True),
        "pipe 'pipe' is calibrated by the pose that it does not carry|interface: {position: true}",
    ),
    (
        base(message="geometry_msgs::PoseStamped", interface={"velocity": True}),
        f"the message of 'pipe' carries no angular and no linear|velocity: false{ANOTHER}",
    ),
    (
        base(message="sensor_msgs::Imu"),
        f"the message of 'pipe' carries no position|convention.position.type: NONE{ANOTHER}",
    ),
    (
        base(message="nav_msgs::Odometry", convention=ANGLES),
        f"the message of 'pipe' has no orientation of the type EULER|type: QUATERNION{ANOTHER}",
    ),
    (
        base(message="geometry_msgs::Vector3Stamped", convention=QUATERNION),
        f"the message of 'pipe' has no orientation of the type QUATERNION|type: EULER{ANOTHER}",
    ),
    (
        sent(message="geometry_msgs::PoseStamped", interface={"velocity": True}),
        f"geometry_msgs/PoseStamped carries no 'velocity'|velocity: false{ANOTHER}",
    ),
    (
        sent(convention=ANGLES),
        "nav_msgs/Odometry is sent with a quaternion and a position|orientation.type: QUATERNION, position.type: FULL",
    ),
    (
        sent(filter={"frequency": 20.0, "damping": 0.8}),
        "controller 'pipe' filters the state of a link|a filter in the pipe that receives it",
    ),
]


def text_of(error):
    """Join what an error says."""
    names = f"|{', '.join(error.names)}" if error.names else ""
    return f"{error.what}|{error.expected}{names}"


@pytest.mark.parametrize(("record", "text"), REFUSED, ids=[text for _, text in REFUSED])
def test_records_that_do_not_fit_are_named(record, text):
    context = PipeContext(make_robot(), MemoryMiddleware(Bus(), "cart"), {}, RATE)
    make = factory.controller if hasattr(record, "sink") else factory.feedback
    with pytest.raises(SolferError) as error:
        make(record, context)
    assert text_of(error.value) == text


def test_a_fixed_robot_has_no_base_to_receive():
    description = Description.from_text(URDF.replace('type="floating"', 'type="fixed"'))
    robot = Robot(Kinematics(description), Semantics.from_text('<robot name="cart"/>', description))
    with pytest.raises(SolferError) as error:
        factory.feedback(base(), PipeContext(robot, MemoryMiddleware(Bus(), "cart"), {}, RATE))
    assert text_of(error.value) == (
        f"pipe 'pipe' carries a floating base, but '{robot.name}' has none|a URDF with a floating joint"
    )


def test_an_interface_has_to_carry_something():
    with pytest.raises(SolferError) as error:
        fields_of(InterfaceRecord(), "pipe")
    assert text_of(error.value) == "pipe 'pipe' carries no interface|at least one true"


def test_names_of_a_message_are_compared():
    """Unknown, doubled and missing names are refused; a partial message is accepted, and what is absent is noted."""
    order = NameOrder(("a", "b", "c"), ("d",))
    texts = {
        ("a", "b", "a", "b"): "it has joints twice: a, b|each name once",
        ("a", "e"): "unknown joint 'e'|one of a, b, c, d",
        ("d",): "it has none of the pipe's 3 joints|some of a, b, c",
    }
    for names, text in texts.items():
        with pytest.raises(SolferError) as error:
            order.match(names)
        assert text_of(error.value) == text
    with pytest.raises(SolferError) as error:
        order.require_all(("d", "b"))
    assert text_of(error.value) == "it lacks the joints a, c|all of a, b, c"
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
    with pytest.raises(SolferError, match="shuolder"):
        order.match(("shuolder", "elbow"))
    assert order.match(("shuolder", "shoulder", "elbow")).source.tolist() == [1, 2]
