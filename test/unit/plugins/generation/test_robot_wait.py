"""Plugins wait for the robot that they are made for."""

from types import SimpleNamespace

import pytest

from solfer.config import TextRecord
from solfer.errors import UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins.generation.robot_wait import ROBOT_POLL_PERIOD, ROBOT_REPEAT_PERIOD, missing, wait_for_robot

KIND = "sensor_msgs/JointState"


def configuration(urdf="/robot_description", source="joint_states", initialize=True):
    """Make what is looked at of a configuration."""
    feedback = SimpleNamespace(
        measures_joints=True, initialize=initialize, source=source, where=lambda tag: f"robot.yaml:7:3 {tag}"
    )
    sources = SimpleNamespace(urdf=TextRecord.model_validate(urdf), srdf=None)
    return SimpleNamespace(sources=sources, feedbacks=(feedback,))


@pytest.fixture
def bus():
    return Bus()


@pytest.fixture
def node(bus):
    return MemoryMiddleware(bus, "plugin")


def describe(bus):
    bus.parameters["robot_description"] = "<robot/>"


def publish(bus, topic="joint_states"):
    MemoryMiddleware(bus, "robot").writer(topic, KIND)


def test_a_plugin_waits_until_its_robot_comes(bus, node, caplog):
    """It names what it waits for once, then every 10 s, and each time that it changes."""
    caplog.set_level("INFO")
    bus.parameters.clear()
    begun = bus.time

    def pause():
        passed = bus.time - begun
        node.sleep_until(bus.time + ROBOT_POLL_PERIOD)
        if passed > 2.5 * ROBOT_REPEAT_PERIOD:
            describe(bus)
        if passed > 3.2 * ROBOT_REPEAT_PERIOD:
            publish(bus)

    assert wait_for_robot([configuration()], node, node.running, pause)
    first = "waits for the robot: no parameter '/robot_description' of a living robot"
    assert [message.startswith(first) for message in caplog.messages] == [True, True, True, False, False]
    assert caplog.messages[3:] == [
        "waits for the robot: no publisher on joint_states (robot.yaml:7:3 source)",
        "the robot is there",
    ]


def test_a_robot_that_is_there_is_not_waited_for(bus, node, caplog):
    describe(bus)
    publish(bus)
    assert wait_for_robot([configuration()], node, node.running, pytest.fail) and not caplog.messages


def test_the_end_ends_the_wait(bus, node):
    looks = iter((True, True, False))
    paused = []
    assert not wait_for_robot([configuration()], node, lambda: next(looks), lambda: paused.append(1))
    assert len(paused) == 2


def test_a_misspelt_name_is_not_waited_for(bus, node):
    """The making of the plugin complains, with the name that may have been meant."""
    describe(bus)
    publish(bus)
    publish(bus, "upper_body/reference")
    assert not missing([configuration(source="joint_stats")], node)
    assert missing([configuration(source="torso/measured")], node)


def test_the_names_of_another_robot_are_not_meant(bus, node):
    """Robots in namespaces are there already."""
    for robot in ("a", "left"):
        bus.parameters[f"/{robot}/robot_description"] = "<robot/>"
        publish(bus, f"{robot}/joint_states")
    assert "no parameter '/robot_description'" in missing([configuration()], node)
    describe(bus)
    assert "no publisher on joint_states" in missing([configuration()], node)


def test_a_misspelt_description_ends_the_wait(bus, node):
    """At once, also while joints are missing."""
    describe(bus)
    with pytest.raises(UnknownName, match="did you mean: robot_description"):
        wait_for_robot([configuration("/robot_descripton")], node, node.running, pytest.fail)


def test_a_plugin_that_needs_no_joints_starts_without_them(bus, node):
    describe(bus)
    assert not missing([configuration(initialize=False), configuration(source=None)], node)
