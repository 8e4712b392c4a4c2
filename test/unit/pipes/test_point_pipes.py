"""Robot Points between the ports of two components, in memory."""

import logging
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError
from scipy.spatial.transform import Rotation
from support.unit.joint_pipes import RATE, make_robot

from solfer.components import Component, Port
from solfer.config.kinds.point import QUANTITIES, PointControllerRecord, PointFeedbackRecord
from solfer.errors import PipeError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.transport import MessageStatus
from solfer.transport.messages import PointsMessage, VectorMessage, WrenchMessage

NAMES = ("left", "right", "rear")


class OutputComponent(Component):
    """Has one output."""

    def __init__(self, robot, quantity, count=None):
        super().__init__(robot)
        self.outputs["goal"] = Port(quantity, count)


class Receiver(Component):
    """Has one input."""

    def __init__(self, robot, quantity, count=None):
        super().__init__(robot)
        self.inputs["goal"] = Port(quantity, count)


@pytest.fixture
def middleware():
    return MemoryMiddleware(Bus(), "node")


def around(component, middleware):
    return PipeContext(component.model, middleware, {}, RATE, component.inputs, component.outputs)


def receiving(middleware, port="position", size=None, **tags):
    """Make a component, and the pipe that feeds it from the topic `goal`."""
    component = Receiver(make_robot(), port, size)
    record = {"name": "goal", "space": "POINT" if size is None else "POINTS", "quantity": port, "source": "goal"}
    return component, factory.feedback(PointFeedbackRecord.model_validate(record | tags), around(component, middleware))


def publishing(middleware, port="position", size=None, **tags):
    """Make a component, and the pipe that publishes its output on the topic `goal`."""
    component = OutputComponent(make_robot(), port, size)
    record = {
        "name": "goal",
        "space": "POINT" if size is None else "POINTS",
        "quantity": port,
        "sink": "goal",
        "type": "reference",
    }
    made = factory.controller(PointControllerRecord.model_validate(record | tags), around(component, middleware))
    return component, made


def numbers(quantity, count):
    values = np.random.default_rng(4).standard_normal(((count or 1), QUANTITIES[quantity]))
    if quantity in ("orientation", "pose"):
        values[:, -4:] /= np.linalg.norm(values[:, -4:], axis=1)[:, None]
    return values if count else values[0]


@pytest.mark.parametrize("count", [None, 3])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_every_quantity_goes_from_port_to_port(middleware, quantity, count):
    tags = {"names": NAMES} if count else {}
    sender, out = publishing(middleware, quantity, count, **tags)
    receiver, received = receiving(middleware, quantity, count, **tags)
    port = receiver.inputs["goal"]
    assert received.run() is MessageStatus.NONE and not port.fresh
    sender.outputs["goal"].value[:] = numbers(quantity, count)
    out.collect()
    out.send(1.0)
    assert received.run() is MessageStatus.NEW and port.fresh
    assert_allclose(port.value, numbers(quantity, count), atol=0.0)
    assert received.run() is MessageStatus.OLD and not port.fresh
    assert_allclose(port.value, numbers(quantity, count), atol=0.0)


def test_points_are_mapped_by_name_or_by_count(middleware):
    writer = middleware.writer("goal", "solfer/RobotPoints")
    receiver, received = receiving(middleware, "force", 3, names=NAMES)
    values = np.arange(9.0).reshape(3, 3)
    writer.write(PointsMessage("world", ("rear", "left", "right"), values))
    received.run()
    assert_allclose(receiver.inputs["goal"].value, values[[1, 2, 0]])
    counted, other = receiving(middleware, "force", 3, count=3)
    writer.write(PointsMessage("world", (), values))
    other.run()
    assert_allclose(counted.inputs["goal"].value, values)


@pytest.mark.parametrize(
    "message, match",
    [
        (PointsMessage("world", ("left", "right", "front"), np.zeros((3, 3))), "unknown Point 'front'"),
        (PointsMessage("world", ("left", "right", "rear", "left"), np.zeros((4, 3))), "Points twice: left"),
        (PointsMessage("world", NAMES, np.zeros((3, 2))), r"shape \(3, 2\)"),
        (PointsMessage("arm", NAMES, np.zeros((3, 3))), "axes of 'arm'"),
        (PointsMessage("world", NAMES, np.full((3, 3), np.nan)), "not finite"),
    ],
)
def test_an_unfit_message_is_refused_whole(middleware, message, match, caplog):
    receiver, received = receiving(middleware, "force", 3, names=NAMES)
    receiver.inputs["goal"].value[:] = 5.0
    middleware.writer("goal", "solfer/RobotPoints").write(message)
    with caplog.at_level(logging.WARNING):
        assert received.run() is MessageStatus.OLD
    assert received.refused == 1 and (receiver.inputs["goal"].value == 5.0).all()
    assert re.search(match, caplog.text)


def test_orientations_have_the_length_one(middleware, caplog):
    receiver, received = receiving(middleware, "pose")
    middleware.writer("goal", "geometry_msgs/PoseStamped").write(VectorMessage("world", np.zeros(7)))
    assert received.run() is MessageStatus.OLD and "norm 0" in caplog.text
    assert_allclose(receiver.inputs["goal"].value, (0, 0, 0, 0, 0, 0, 1))


def test_axes_may_be_fixed_to_a_link(middleware):
    receiver, received = receiving(middleware, "wrench", interface="fixed", link="arm")
    writer = middleware.writer("goal", "geometry_msgs/WrenchStamped")
    writer.write(WrenchMessage("world", np.ones(3), np.ones(3)))
    assert received.run() is MessageStatus.OLD
    writer.write(WrenchMessage("arm", np.ones(3), np.zeros(3)))
    assert received.run() is MessageStatus.NEW
    assert_allclose(receiver.inputs["goal"].value, (1, 1, 1, 0, 0, 0))


def test_values_that_are_not_finite_are_not_sent(middleware, caplog):
    sender, out = publishing(middleware)
    reader = middleware.reader("goal", "geometry_msgs/PointStamped")
    sender.outputs["goal"].value[1] = np.inf
    out.collect()
    out.send(0.0)
    assert reader.read() is MessageStatus.NONE and "a position that is not finite is not sent" in caplog.text
    sender.outputs["goal"].value[1] = 2.0
    out.collect()
    out.send(0.0)
    assert reader.read() is MessageStatus.NEW and reader.message.values[1] == 2.0


@pytest.mark.parametrize(
    "tags, error, match",
    [
        ({"name": "gaol"}, UnknownName, "did you mean: goal"),
        ({"quantity": "pose"}, PipeError, "quantity: position"),
        ({"space": "POINTS", "count": 2}, PipeError, "space: POINT"),
        ({"interface": "fixed", "link": "amr"}, UnknownName, "did you mean: arm"),
        ({"message": "geometry_msgs/PoseStamped"}, PipeError, "carries no Point of the quantity 'position'"),
        ({"interface": "fixed"}, ValueError, "needs the key 'link'"),
        ({"names": ("a", "b")}, ValueError, "a POINT needs none of them"),
        ({"space": "POINTS"}, ValueError, "either 'names' or 'count'"),
        ({"space": "POINTS", "names": ("a", "a")}, ValueError, "stands twice"),
        ({"filter": {"frequency": 3.0}}, ValueError, "a Point has no 'filter'"),
        ({"dofs": {"chain": "all", "type": "all", "mapping": "RBDL"}}, ValueError, "dofs"),
    ],
)
def test_mistakes_are_named(middleware, tags, error, match):
    with pytest.raises(error, match=match):
        receiving(middleware, **tags)


def test_a_port_has_a_known_quantity():
    with pytest.raises(UnknownName, match="did you mean: position"):
        Port("positoin")


JPL = {"orientation": {"type": "QUATERNION", "convention": "JPL", "order": "wxyz"}}
TURN = Rotation.from_euler("XYZ", (0.3, -0.5, 1.1))


def external(turn):
    """Write a rotation as a JPL quaternion, w first."""
    x, y, z, w = turn.as_quat()
    return np.array((w, -x, -y, -z))


@pytest.mark.parametrize("quantity", ["orientation", "pose"])
def test_conventions_act_on_the_wire(middleware, quantity):
    sender, out = publishing(middleware, quantity, convention=JPL)
    listener, into = receiving(middleware, quantity, convention=JPL)
    wire = middleware.reader("goal", out.writer.carries)
    place = [0.1, 0.2, 0.3] if quantity == "pose" else []
    sender.outputs["goal"].value[:] = [*place, *TURN.as_quat()]
    out.collect()
    out.send(0.0)
    wire.read()
    assert_allclose(wire.message.values, [*place, *external(TURN)], atol=1e-12)
    assert into.run() is MessageStatus.NEW
    assert_allclose(listener.inputs["goal"].value, sender.outputs["goal"].value, atol=1e-12)


def test_conventions_act_on_each_of_several(middleware):
    listener, into = receiving(middleware, "pose", 3, names=NAMES, convention=JPL)
    writer = middleware.writer("goal", "solfer/RobotPoints")
    turns = [Rotation.from_euler("x", angle) for angle in (0.2, 0.4, 0.6)]
    rows = np.array([[0.0, 0.0, index, *external(turn)] for index, turn in enumerate(turns)])
    writer.write(PointsMessage("world", NAMES, rows))
    assert into.run() is MessageStatus.NEW
    assert_allclose(listener.inputs["goal"].value[:, 3:], [turn.as_quat() for turn in turns], atol=1e-12)
    writer.write(PointsMessage("world", NAMES[1:2], np.array([[0.0, 0.0, 7.0, *external(TURN)]])))
    assert into.run() is MessageStatus.NEW
    assert_allclose(listener.inputs["goal"].value[:, 3:], [each.as_quat() for each in (turns[0], TURN, turns[2])])
    assert_allclose(listener.inputs["goal"].value[:, 2], (0.0, 7.0, 2.0))


@pytest.mark.parametrize("axes, order", [(None, "XYZ"), ((2, 1, 0), "ZYX")])
def test_angles_are_read_in_their_order(middleware, axes, order):
    tags = {} if axes is None else {"output_angles": {f"angle_{index + 1}": axis for index, axis in enumerate(axes)}}
    listener, into = receiving(middleware, "orientation", convention={"orientation": {"type": "EULER"}}, **tags)
    angles = np.array((0.2, -0.4, 0.7))
    middleware.writer("goal", "geometry_msgs/Vector3Stamped").write(VectorMessage("world", angles))
    assert into.run() is MessageStatus.NEW
    turned = Rotation.from_euler(order, [angles["XYZ".index(axis)] for axis in order])
    assert_allclose(np.abs(np.dot(listener.inputs["goal"].value, turned.as_quat())), 1.0, atol=1e-12)


def test_a_position_that_is_ignored_stays(middleware):
    listener, into = receiving(middleware, "pose", convention={"position": {"type": "NONE"}})
    listener.inputs["goal"].value[:3] = 9.0
    message = VectorMessage("world", np.array([np.nan, 1.0, 2.0, *TURN.as_quat()]))
    middleware.writer("goal", "geometry_msgs/PoseStamped").write(message)
    assert into.run() is MessageStatus.NEW
    assert_allclose(listener.inputs["goal"].value, [9.0, 9.0, 9.0, *TURN.as_quat()])


@pytest.mark.parametrize(
    "make, quantity, tags, match",
    [
        (receiving, "position", {"convention": JPL}, "'position' has no conventions"),
        (receiving, "pose", {"convention": {"twist": {"frame": "body"}}}, "tag 'interface'"),
        (receiving, "orientation", {"convention": {"position": {"type": "NONE"}}}, "no position"),
        (receiving, "pose", {"convention": {"orientation": {"type": "EULER"}}}, "only received"),
        (publishing, "orientation", {"convention": {"orientation": {"type": "EULER"}}}, "only received"),
        (receiving, "pose", {"output_angles": {"angle_1": 0, "angle_2": 1, "angle_3": 2}}, "without angles"),
    ],
)
def test_conventions_without_effect_are_refused(middleware, make, quantity, tags, match):
    with pytest.raises(ValidationError, match=match):
        make(middleware, quantity, **tags)
