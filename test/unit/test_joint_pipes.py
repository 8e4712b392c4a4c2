"""Joint-space pipes of configurations: which DoFs, which State, any interfaces, and filters, without a robot."""

import numpy as np
import pytest
from cart import URDF
from numpy.testing import assert_allclose
from pydantic import ValidationError
from scipy import signal

from solfer.config.pipes import ControllerRecord, DofsRecord, FeedbackRecord
from solfer.errors import ConfigError, PipeError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import BidirectionalMap, Description, Kinematics, Semantics
from solfer.pipes import JointMessage, Status, Surroundings, factory
from solfer.pipes.dofs import select
from solfer.robot import Robot

RATE = 200.0
SRDF = '<robot name="cart"><group name="front"><joint name="free"/><joint name="shoulder"/></group></robot>'


def make_robot():
    description = Description.from_text(URDF)
    robot = Robot(Kinematics(description), Semantics.from_text(SRDF, description))
    robot.maps.add(BidirectionalMap("LIMBS", robot.dofs, ("roll", "shoulder", "nose")))
    return robot


@pytest.fixture
def surroundings():
    return Surroundings(make_robot(), MemoryMiddleware(Bus(), "cart"), {}, RATE)


def dofs(**changes):
    return {"chain": "all", "type": "all", "mapping": "RBDL"} | changes


def heard(**changes):
    """A feedback on the topic `told`."""
    return FeedbackRecord.model_validate({
        "name": "pipe", "space": "JOINT", "dofs": dofs(), "interface": {"position": True}, "function": "reference",
        "source": "told", "message": "custom_messages::CustomCmnd"} | changes)


def told(**changes):
    """A controller on the topic `told`."""
    return ControllerRecord.model_validate({
        "name": "pipe", "type": "reference", "dofs": dofs(), "interface": {"position": True}, "sink": "told"} | changes)


BASE = ["x", "y", "z", "rx", "ry", "rz"]


@pytest.mark.parametrize("chain, kind, names", [
    ("all", "all", [*BASE, "roll", "shoulder"]),
    ("all", "actuated", ["roll", "shoulder"]),
    ("all", "unactuated", BASE),
    ("all", "LIMBS", ["roll", "shoulder"]),
    ("front", "all", [*BASE, "shoulder"]),
    ("front", "actuated", ["shoulder"]),
    ("front", "unactuated", BASE),
    ("front", "LIMBS", ["shoulder"]),
])
def test_chain_and_type_choose_the_dofs(chain, kind, names):
    robot = make_robot()
    record = DofsRecord(chain=chain, type=kind, mapping="RBDL")
    assert [robot.dofs[index] for index in select(record, robot)] == names


@pytest.mark.parametrize("changes, error, match", [
    ({"type": "actuatde"}, UnknownName, "did you mean: actuated"),
    ({"type": "LIMB"}, UnknownName, "did you mean: LIMBS"),
    ({"chain": "fornt"}, UnknownName, "did you mean: front"),
    ({"mapping": "RDBL"}, UnknownName, "did you mean: RBDL"),
    ({"type": "body", "name": "arm"}, PipeError, "space: OPERATIONAL"),
    ({"type": "unactuated", "mapping": "ACTUATED"}, PipeError, "carries no DoF"),
])
def test_unknown_dofs_are_refused(surroundings, changes, error, match):
    with pytest.raises(error, match=match):
        factory.feedback(heard(dofs=dofs(**changes)), surroundings)


@pytest.mark.parametrize("function", ["state", "motor", "reference"])
@pytest.mark.parametrize("fields", [("position",), ("velocity", "effort"), ("position", "velocity", "effort")])
def test_any_interfaces_go_from_one_robot_to_another(surroundings, function, fields):
    interface = {field: True for field in fields}
    mine, theirs = surroundings.robot, make_robot()
    there = Surroundings(theirs, surroundings.middleware, {}, RATE)
    sender = factory.controller(told(interface=interface, function=function), surroundings)
    receiver = factory.feedback(heard(interface=interface, function=function), there)
    assert receiver.run() is Status.NONE
    names = {"position": "position", "velocity": "velocity", "effort": "torque"}
    written = {"state": "state", "motor": "motor", "reference": "command"}[function]
    source, target = (getattr(robot, written) for robot in (mine, theirs))
    random = np.random.default_rng(2)
    for name in names.values():
        source[name] = random.standard_normal(mine.size)
    sender.collect()
    sender.send(0.5)
    assert receiver.run() is Status.NEW
    for field, name in names.items():
        expected = source[name] if field in fields else np.zeros(mine.size)
        assert_allclose(target[name], expected, atol=0.0)
    for untouched in {"state", "motor", "command"} - {written}:
        state = getattr(theirs, untouched)
        assert not state.position.any() and not state.velocity.any() and not state.torque.any()


def test_the_motor_side_has_joints_only():
    for record, more in ((FeedbackRecord, {"source": "told"}), (ControllerRecord, {"sink": "told"})):
        with pytest.raises(ValidationError, match="the motor side in OPERATIONAL space"):
            record.model_validate({"name": "pipe", "space": "OPERATIONAL", "dofs": dofs(type="body", name="arm"),
                                   "interface": {"position": True}, "function": "motor"} | more)


def low_passed(values, frequency, damping):
    """SciPy's filter, started at the first value."""
    bent = 2.0 * RATE * np.tan(np.pi * frequency / RATE)
    numerator, denominator = signal.bilinear([bent**2], [1.0, 2.0 * damping * bent, bent**2], RATE)
    start = signal.lfilter_zi(numerator, denominator) * values[0]
    return signal.lfilter(numerator, denominator, values, zi=start)[0]


FILTER = {"frequency": 20.0, "damping": 0.8}


def test_a_feedback_is_filtered_in_every_cycle_whether_there_is_news_or_not(surroundings):
    writer = surroundings.middleware.writer("told", "solfer/JointCommand")
    pipe = factory.feedback(heard(dofs=dofs(type="actuated"), filter=FILTER), surroundings)
    state, seen = surroundings.robot.command, []
    news = {0: 3.0, 1: 4.0, 5: -1.0, 6: 2.0}
    for cycle in range(12):
        if cycle in news:
            writer.write(JointMessage(("roll", "shoulder"), np.array((news[cycle], 1.0))))
        pipe.run()
        seen.append(state.position[6])
    held = [3.0, 4.0, 4.0, 4.0, 4.0, -1.0] + 6 * [2.0]
    assert_allclose(seen, low_passed(held, **FILTER), atol=1e-12)
    assert_allclose(state.position[7], 1.0, atol=1e-12)


def test_a_refused_message_does_not_reach_the_filter(surroundings):
    writer = surroundings.middleware.writer("told", "solfer/JointCommand")
    pipe = factory.feedback(heard(dofs=dofs(type="actuated"), filter=FILTER), surroundings)
    for position in (1.0, np.nan, 1.0):
        writer.write(JointMessage(("roll", "shoulder"), np.array((1.0, position))))
        pipe.run()
        assert_allclose(surroundings.robot.command.position[6:], 1.0, atol=1e-12)
    assert (pipe.accepted, pipe.refused) == (2, 1)


def test_a_controller_is_filtered_and_starts_anew_after_a_reset(surroundings):
    pipe = factory.controller(told(filter=FILTER), surroundings)
    wanted, seen = [1.0, 2.0, 0.0, 0.0, 5.0], []
    for value in wanted:
        surroundings.robot.command.position[6] = value
        pipe.collect()
        seen.append(pipe.message.position[6])
    assert_allclose(seen, low_passed(wanted, **FILTER), atol=1e-12)
    pipe.reset()
    surroundings.robot.command.position[6] = -3.0
    pipe.collect()
    assert_allclose(pipe.message.position[6], -3.0, atol=1e-12)


def test_a_filter_acts_only_if_it_runs_and_only_below_half_of_the_rate(surroundings):
    pipe = factory.controller(told(filter={"run": False, "frequency": 500.0}), surroundings)
    surroundings.robot.command.position[6] = 1.0
    pipe.collect()
    surroundings.robot.command.position[6] = 2.0
    pipe.collect()
    assert pipe.message.position[6] == 2.0
    with pytest.raises(ConfigError, match="cut-off frequency of 500 Hz at 200 steps a second"):
        factory.controller(told(filter={"frequency": 500.0}), surroundings)
