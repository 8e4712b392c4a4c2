"""Wrenches of contacts between Robots, in memory: frames, arms, names, and unfit messages."""

import logging
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError
from support.robots import centauro

from solfer.config.kinds.contact import ContactControllerRecord, ContactFeedbackRecord
from solfer.errors import PipeError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.transport import MessageStatus
from solfer.transport.messages import PointsMessage, WrenchMessage

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
WHEELS = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg")
ARMS = ("left_arm", "right_arm")
WRENCH = np.array([3.0, -5.0, 200.0, 0.7, -0.3, 0.1])


@pytest.fixture
def middleware():
    return MemoryMiddleware(Bus(), "node")


def standing(seed=5, contacts=True):
    """Load a CENTAURO at a random posture, with its base turned."""
    robot = centauro(contacts=contacts)
    robot.state.position[:] = np.random.default_rng(seed).uniform(-0.3, 0.3, robot.size)
    robot.update()
    return robot


def receiving(robot, middleware, space="CONTACT", **tags):
    record = {"name": WHEELS[0], "space": space, "source": "ground", **tags}
    return factory.feedback(ContactFeedbackRecord.model_validate(record), PipeContext(robot, middleware, {}, 200.0))


def publishing(robot, middleware, space="CONTACT", **tags):
    record = ContactControllerRecord.model_validate(
        {"name": WHEELS[0], "space": space, "sink": "ground", "type": "reference", **tags}
    )
    return factory.controller(record, PipeContext(robot, middleware, {}, 200.0))


def publish(pipe):
    pipe.collect()
    pipe.send(1.0)


@pytest.mark.parametrize("interface, frame", [("world", "world"), ("fixed", "wheel_1")])
def test_a_received_wrench_acts_at_the_contact(middleware, interface, frame):
    robot = standing()
    pipe = receiving(robot, middleware, interface=interface)
    assert pipe.run() is MessageStatus.NONE
    middleware.writer("ground", "geometry_msgs/WrenchStamped").write(WrenchMessage(frame, WRENCH[:3], WRENCH[3:]))
    assert pipe.run() is MessageStatus.NEW
    turn = robot.kinematics.rotation("wheel_1") if interface == "fixed" else np.eye(3)
    force, torque, contact = turn @ WRENCH[:3], turn @ WRENCH[3:], robot.contacts[WHEELS[0]]
    assert_allclose(contact.force, force, atol=1e-12)
    arm = robot.kinematics.position("wheel_1") - contact.value  # from the contact to the link
    assert np.linalg.norm(arm) > 0.05
    assert_allclose(contact.wrench[3:], torque + np.cross(arm, force), atol=1e-12)
    assert not robot.contacts.wrenches[1:].any()


def test_a_wrench_is_read_at_the_present_state(middleware):
    robot = standing()
    pipe = receiving(robot, middleware, interface="fixed")
    robot.state.position[3:6] += 0.2
    middleware.writer("ground", "geometry_msgs/WrenchStamped").write(WrenchMessage("wheel_1", WRENCH[:3], WRENCH[3:]))
    pipe.run()
    robot.update()
    assert_allclose(robot.contacts[0].force, robot.kinematics.rotation("wheel_1") @ WRENCH[:3], atol=1e-12)


@pytest.mark.parametrize("interface", ["world", "fixed"])
def test_one_robot_receives_the_wrench_of_another(middleware, interface):
    sender, receiver = standing(), standing()
    out = publishing(sender, middleware, contact="left_arm", interface=interface)
    received = receiving(receiver, middleware, contact="left_arm", interface=interface)
    sender.contacts["left_arm"].wrench = WRENCH
    publish(out)
    received.run()
    assert_allclose(receiver.contacts["left_arm"].wrench, WRENCH, atol=1e-12)


def test_all_contacts_travel_in_one_message_by_name(middleware):
    sender, receiver = standing(), standing()
    out = publishing(sender, middleware, "CONTACTS")
    some = receiving(receiver, middleware, "CONTACTS", names=WHEELS[::-1])
    sender.contacts.wrenches[:] = np.outer(np.arange(1.0, 7.0), WRENCH)
    publish(out)
    assert out.sent.names == (*WHEELS, *ARMS) and out.sent.frame == "world"
    assert_allclose(out.sent.values[:, :3], sender.contacts.forces)
    assert np.abs(out.sent.values - sender.contacts.wrenches).max() > 1.0  # torques about the links
    middleware.writer("ground", "solfer/RobotPoints").write(
        PointsMessage("world", out.sent.names[:4], out.sent.values[:4])
    )
    assert some.run() is MessageStatus.NEW
    assert_allclose(receiver.contacts.wrenches[:4], sender.contacts.wrenches[:4], atol=1e-10)
    assert not receiver.contacts.wrenches[4:].any()


def test_the_center_of_pressure_follows(middleware):
    robot = standing()
    pipe = receiving(robot, middleware, "CONTACTS", names=ARMS)
    weights = np.array([[0.0, 0.0, 300.0, 0.0, 0.0, 0.0], [0.0, 0.0, 100.0, 0.0, 0.0, 0.0]])
    middleware.writer("ground", "solfer/RobotPoints").write(PointsMessage("world", ARMS, weights))
    pipe.run()
    expected = 0.75 * robot.kinematics.position("arm1_7") + 0.25 * robot.kinematics.position("arm2_7")
    assert_allclose(robot.center_of_pressure.value[:2], expected[:2], atol=1e-12)


@pytest.mark.parametrize(
    "message, words",
    [
        (WrenchMessage("wheel_1", WRENCH[:3], WRENCH[3:]), "axes of 'wheel_1'"),
        (WrenchMessage("world", np.full(3, np.nan), WRENCH[3:]), "not finite"),
    ],
)
def test_an_unfit_message_is_refused_whole(middleware, message, words, caplog):
    robot = standing()
    pipe = receiving(robot, middleware)
    robot.contacts.wrenches[0] = WRENCH
    middleware.writer("ground", "geometry_msgs/WrenchStamped").write(message)
    with caplog.at_level(logging.WARNING):
        assert pipe.run() is MessageStatus.OLD
    assert words in caplog.text
    assert_allclose(robot.contacts.wrenches[0], WRENCH)


def test_wrenches_that_are_not_finite_are_not_sent(middleware):
    robot = standing()
    out, received = publishing(robot, middleware), receiving(standing(), middleware)
    robot.contacts.wrenches[0, 2] = np.inf
    publish(out)
    assert received.run() is MessageStatus.NONE


def test_mistakes_are_named(middleware):
    with pytest.raises(UnknownName, match="contact 'front_left_lag'"):
        receiving(standing(), middleware, contact="front_left_lag")
    with pytest.raises(PipeError, match="the Robot has none"):
        receiving(standing(contacts=False), middleware)
    with pytest.raises(PipeError, match="carries no wrenches of contacts"):
        receiving(standing(), middleware, "CONTACTS", message="geometry_msgs/WrenchStamped")


@pytest.mark.parametrize(
    "tags, words",
    [
        ({"space": "CONTACTS", "interface": "fixed"}, "axes of the world"),
        ({"space": "CONTACTS", "contact": "left_arm"}, "CONTACTS have 'names'"),
        ({"space": "CONTACT", "names": ARMS}, "a CONTACT has 'contact'"),
        ({"space": "CONTACTS", "names": ("left_arm", "left_arm")}, "stands twice"),
        ({"space": "CONTACT", "function": "reference"}, "function"),
        ({"space": "CONTACT", "filter": {"frequency": 3.0}}, "a contact has no 'filter'"),
    ],
)
def test_the_grammar_of_contacts(tags, words):
    with pytest.raises(ValidationError, match=words):
        ContactFeedbackRecord.model_validate({"name": "ground", "source": "ground"} | tags)


def test_contacts_that_a_message_lacks_keep_their_wrenches(middleware):
    robot = standing()
    pipe = receiving(robot, middleware, "CONTACTS")
    robot.contacts.wrenches[:] = WRENCH
    writer = middleware.writer("ground", "solfer/RobotPoints")
    writer.write(PointsMessage("world", (*ARMS[::-1], "tail"), np.arange(18.0).reshape(3, 6)))
    assert pipe.run() is MessageStatus.NEW
    assert_allclose(robot.contacts.forces[4:], [(6.0, 7.0, 8.0), (0.0, 1.0, 2.0)])
    assert_allclose(robot.contacts.wrenches[:4], np.tile(WRENCH, (4, 1)))


def test_a_pipe_with_names_refuses_unknown_contacts(middleware, caplog):
    pipe = receiving(standing(), middleware, "CONTACTS", names=ARMS)
    writer = middleware.writer("ground", "solfer/RobotPoints")
    writer.write(PointsMessage("world", (*ARMS, WHEELS[0]), np.zeros((3, 6))))
    assert pipe.run() is MessageStatus.NEW
    writer.write(PointsMessage("world", (*ARMS, "tail"), np.zeros((3, 6))))
    with caplog.at_level(logging.WARNING):
        assert pipe.run() is MessageStatus.OLD
    assert "'tail'" in caplog.text
