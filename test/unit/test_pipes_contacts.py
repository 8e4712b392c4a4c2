"""Wrenches of contacts between Robots, in memory: frames, arms, names, and what does not fit."""

import logging
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError

from solfer import Robot
from solfer.config.contacts import ContactControllerRecord, ContactFeedbackRecord
from solfer.errors import PipeError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import Status, Surroundings, factory
from solfer.pipes.messages import PointsMessage, WrenchMessage

CENTAURO = Path(__file__).parents[2] / "config/robots/centauro"
WHEELS = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg")
ARMS = ("left_arm", "right_arm")
WRENCH = np.array([3.0, -5.0, 200.0, 0.7, -0.3, 0.1])


@pytest.fixture
def middleware():
    return MemoryMiddleware(Bus(), "node")


def standing(seed=5, contacts=True):
    """A CENTAURO somewhere, its base turned."""
    file = CENTAURO / "contacts.yaml" if contacts else None
    robot = Robot.load(CENTAURO / "centauro.urdf", CENTAURO / "centauro.srdf", contacts=file)
    robot.state.position[:] = np.random.default_rng(seed).uniform(-0.3, 0.3, robot.size)
    robot.update()
    return robot


def hearing(robot, middleware, space="CONTACT", **tags):
    record = {"name": WHEELS[0], "space": space, "source": "ground", **tags}
    return factory.feedback(ContactFeedbackRecord.model_validate(record), Surroundings(robot, middleware, {}, 200.0))


def telling(robot, middleware, space="CONTACT", **tags):
    record = ContactControllerRecord.model_validate(
        {"name": WHEELS[0], "space": space, "sink": "ground", "type": "reference", **tags})
    return factory.controller(record, Surroundings(robot, middleware, {}, 200.0))


def tell(pipe):
    pipe.collect()
    pipe.send(1.0)


@pytest.mark.parametrize("interface, frame", [("world", "world"), ("fixed", "wheel_1")])
def test_a_wrench_comes_about_the_link_and_acts_at_the_contact(middleware, interface, frame):
    robot = standing()
    pipe = hearing(robot, middleware, interface=interface)
    assert pipe.run() is Status.NONE
    middleware.writer("ground", "geometry_msgs/WrenchStamped").write(WrenchMessage(frame, WRENCH[:3], WRENCH[3:]))
    assert pipe.run() is Status.NEW
    turn = robot.kinematics.rotation("wheel_1") if interface == "fixed" else np.eye(3)
    force, torque, contact = turn @ WRENCH[:3], turn @ WRENCH[3:], robot.contacts[WHEELS[0]]
    assert_allclose(contact.force, force, atol=1e-12)
    arm = robot.kinematics.position("wheel_1") - contact.value  # from the contact to the link
    assert np.linalg.norm(arm) > 0.05
    assert_allclose(contact.wrench[3:], torque + np.cross(arm, force), atol=1e-12)
    assert not robot.contacts.wrenches[1:].any()


def test_a_wrench_acts_where_the_robot_is_when_it_is_read(middleware):
    robot = standing()
    pipe = hearing(robot, middleware, interface="fixed")
    robot.state.position[3:6] += 0.2
    middleware.writer("ground", "geometry_msgs/WrenchStamped").write(WrenchMessage("wheel_1", WRENCH[:3], WRENCH[3:]))
    pipe.run()
    robot.update()
    assert_allclose(robot.contacts[0].force, robot.kinematics.rotation("wheel_1") @ WRENCH[:3], atol=1e-12)


@pytest.mark.parametrize("interface", ["world", "fixed"])
def test_what_one_robot_tells_another_one_hears(middleware, interface):
    teller, listener = standing(), standing()
    out = telling(teller, middleware, contact="left_arm", interface=interface)
    heard = hearing(listener, middleware, contact="left_arm", interface=interface)
    teller.contacts["left_arm"].wrench = WRENCH
    tell(out)
    heard.run()
    assert_allclose(listener.contacts["left_arm"].wrench, WRENCH, atol=1e-12)


def test_all_contacts_travel_in_one_message_by_name(middleware):
    teller, listener = standing(), standing()
    out = telling(teller, middleware, "CONTACTS")
    some = hearing(listener, middleware, "CONTACTS", names=WHEELS[::-1])
    teller.contacts.wrenches[:] = np.outer(np.arange(1.0, 7.0), WRENCH)
    tell(out)
    assert out.sent.names == (*WHEELS, *ARMS) and out.sent.frame == "world"
    assert_allclose(out.sent.values[:, :3], teller.contacts.forces)
    assert np.abs(out.sent.values - teller.contacts.wrenches).max() > 1.0  # torques about the links
    middleware.writer("ground", "solfer/RobotPoints").write(
        PointsMessage("world", out.sent.names[:4], out.sent.values[:4]))
    assert some.run() is Status.NEW
    assert_allclose(listener.contacts.wrenches[:4], teller.contacts.wrenches[:4], atol=1e-10)
    assert not listener.contacts.wrenches[4:].any()


def test_the_center_of_pressure_follows(middleware):
    robot = standing()
    pipe = hearing(robot, middleware, "CONTACTS", names=ARMS)
    weights = np.array([[0.0, 0.0, 300.0, 0.0, 0.0, 0.0], [0.0, 0.0, 100.0, 0.0, 0.0, 0.0]])
    middleware.writer("ground", "solfer/RobotPoints").write(PointsMessage("world", ARMS, weights))
    pipe.run()
    expected = 0.75 * robot.kinematics.position("arm1_7") + 0.25 * robot.kinematics.position("arm2_7")
    assert_allclose(robot.center_of_pressure.value[:2], expected[:2], atol=1e-12)


@pytest.mark.parametrize("message, words", [
    (WrenchMessage("wheel_1", WRENCH[:3], WRENCH[3:]), "axes of 'wheel_1'"),
    (WrenchMessage("world", np.full(3, np.nan), WRENCH[3:]), "not finite"),
])
def test_what_does_not_fit_is_refused_whole(middleware, message, words, caplog):
    robot = standing()
    pipe = hearing(robot, middleware)
    robot.contacts.wrenches[0] = WRENCH
    middleware.writer("ground", "geometry_msgs/WrenchStamped").write(message)
    with caplog.at_level(logging.WARNING):
        assert pipe.run() is Status.OLD
    assert words in caplog.text
    assert_allclose(robot.contacts.wrenches[0], WRENCH)


def test_wrenches_that_are_not_finite_are_not_sent(middleware):
    robot = standing()
    out, heard = telling(robot, middleware), hearing(standing(), middleware)
    robot.contacts.wrenches[0, 2] = np.inf
    tell(out)
    assert heard.run() is Status.NONE


def test_mistakes_are_named(middleware):
    with pytest.raises(UnknownName, match="contact 'front_left_lag'"):
        hearing(standing(), middleware, contact="front_left_lag")
    with pytest.raises(PipeError, match="the Robot has none"):
        hearing(standing(contacts=False), middleware)
    with pytest.raises(PipeError, match="carries no wrenches of contacts"):
        hearing(standing(), middleware, "CONTACTS", message="geometry_msgs/WrenchStamped")


@pytest.mark.parametrize("tags, words", [
    ({"space": "CONTACTS", "interface": "fixed"}, "axes of the world"),
    ({"space": "CONTACTS", "contact": "left_arm"}, "CONTACTS have 'names'"),
    ({"space": "CONTACT", "names": ARMS}, "a CONTACT has 'contact'"),
    ({"space": "CONTACTS", "names": ("left_arm", "left_arm")}, "stands twice"),
    ({"space": "CONTACT", "function": "reference"}, "function"),
    ({"space": "CONTACT", "filter": {"frequency": 3.0}}, "a contact has no 'filter'"),
])
def test_the_grammar_of_contacts(tags, words):
    with pytest.raises(ValidationError, match=words):
        ContactFeedbackRecord.model_validate({"name": "ground", "source": "ground"} | tags)


def test_contacts_that_a_message_lacks_keep_what_acts_on_them(middleware):
    robot = standing()
    pipe = hearing(robot, middleware, "CONTACTS")
    robot.contacts.wrenches[:] = WRENCH
    writer = middleware.writer("ground", "solfer/RobotPoints")
    writer.write(PointsMessage("world", (*ARMS[::-1], "tail"), np.arange(18.0).reshape(3, 6)))
    assert pipe.run() is Status.NEW
    assert_allclose(robot.contacts.forces[4:], [(6.0, 7.0, 8.0), (0.0, 1.0, 2.0)])
    assert_allclose(robot.contacts.wrenches[:4], np.tile(WRENCH, (4, 1)))


def test_names_that_the_robot_does_not_have_are_refused_where_names_are_listed(middleware, caplog):
    pipe = hearing(standing(), middleware, "CONTACTS", names=ARMS)
    writer = middleware.writer("ground", "solfer/RobotPoints")
    writer.write(PointsMessage("world", (*ARMS, WHEELS[0]), np.zeros((3, 6))))
    assert pipe.run() is Status.NEW
    writer.write(PointsMessage("world", (*ARMS, "tail"), np.zeros((3, 6))))
    with caplog.at_level(logging.WARNING):
        assert pipe.run() is Status.OLD
    assert "'tail'" in caplog.text
