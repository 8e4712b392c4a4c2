"""Joint-space pipes of configurations: DoFs, States, interfaces and filters, without a robot."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError
from support.unit.joint_pipes import FILTER, RATE, dofs, low_passed, make_robot, published, received

from solfer.config.kinds.body import BodyControllerRecord, BodyFeedbackRecord
from solfer.config.records.pipes import DofsRecord
from solfer.errors import ConfigError, PipeError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.pipes.dofs import select
from solfer.pipes.pipe_warnings import NAMING_DELAY
from solfer.transport import JointMessage, MessageStatus


@pytest.fixture
def context():
    return PipeContext(make_robot(), MemoryMiddleware(Bus(), "cart"), {}, RATE)


BASE = ["x", "y", "z", "rx", "ry", "rz"]


@pytest.mark.parametrize(
    "chain, kind, names",
    [
        ("all", "all", [*BASE, "roll", "shoulder"]),
        ("all", "actuated", ["roll", "shoulder"]),
        ("all", "unactuated", BASE),
        ("all", "LIMBS", ["roll", "shoulder"]),
        ("front", "all", [*BASE, "shoulder"]),
        ("front", "actuated", ["shoulder"]),
        ("front", "unactuated", BASE),
        ("front", "LIMBS", ["shoulder"]),
    ],
)
def test_chain_and_type_choose_the_dofs(chain, kind, names):
    robot = make_robot()
    record = DofsRecord(chain=chain, type=kind, mapping="RBDL")
    assert [robot.dofs[index] for index in select(record, robot)] == names


@pytest.mark.parametrize(
    "changes, error, match",
    [
        ({"type": "actuatde"}, UnknownName, "did you mean: actuated"),
        ({"type": "LIMB"}, UnknownName, "did you mean: LIMBS"),
        ({"chain": "fornt"}, UnknownName, "did you mean: front"),
        ({"mapping": "RDBL"}, UnknownName, "did you mean: RBDL"),
        ({"type": "body", "name": "arm"}, PipeError, "space: OPERATIONAL"),
        ({"type": "unactuated", "mapping": "ACTUATED"}, PipeError, "carries no DoF"),
    ],
)
def test_unknown_dofs_are_refused(context, changes, error, match):
    with pytest.raises(error, match=match):
        factory.feedback(received(dofs=dofs(**changes)), context)


@pytest.mark.parametrize(
    "numbers, words",
    [
        (None, "nothing in 'velocity' (expected: 2 numbers, one for each name, or a pipe with `velocity: false`)"),
        (np.zeros(1), "1 numbers in 'velocity'"),
    ],
)
def test_a_field_that_is_missing_is_named(context, numbers, words, caplog):
    interface = {"position": True, "velocity": True}
    pipe = factory.feedback(received(interface=interface), context)
    writer = context.middleware.writer("joints", "solfer/JointCommand")
    writer.write(JointMessage(("roll", "shoulder"), position=np.ones(2), velocity=numbers))
    pipe.run()
    assert (pipe.accepted, pipe.refused) == (0, 1) and words in caplog.text


@pytest.mark.parametrize("is_reset", [False, True])
def test_a_contradiction_is_logged_unless_the_robot_was_reset(is_reset, caplog):
    """A leap of positions is logged after a delay, in which a reset that explains it may still arrive."""
    bus = Bus()
    context = PipeContext(make_robot(), MemoryMiddleware(bus, "cart"), {}, RATE)
    record = received(function="state", message="sensor_msgs::JointState", dofs=dofs(type="actuated"))
    pipe = factory.feedback(record, context)
    writer = context.middleware.writer("joints", "sensor_msgs/JointState")
    logged = []
    for cycle in range(30):
        bus.run_until(cycle / RATE)
        if is_reset and cycle == 12:
            pipe.restart()
        writer.write(JointMessage(("roll", "shoulder"), position=np.ones(2) * (cycle >= 10)))
        pipe.run()
        logged.append("leaps by" in caplog.text)
    first = 10 + round(NAMING_DELAY * RATE)
    assert logged == [cycle >= first and not is_reset for cycle in range(30)]
    assert pipe.refused == 2 if is_reset else pipe.refused > 10


@pytest.mark.parametrize("tags", [{}, {"filter": FILTER}], ids=["as received", "filtered"])
def test_versions_tell_which_numbers_changed(context, tags):
    """What is computed of a State is computed anew where its version moved, and only there."""
    changed = received(interface={"position": True, "velocity": True}, dofs=dofs(type="actuated"), **tags)
    pipe, state = factory.feedback(changed, context), context.robot.command
    writer = context.middleware.writer("joints", "solfer/JointCommand")
    moved = []
    for position, names in (([1.0, 2.0], 2), ([1.0, 2.0], 2), ([1.0, 2.5], 2), ([1.5], 1)):
        before = state.version("position"), state.version("velocity")
        writer.write(JointMessage(("roll", "shoulder")[:names], np.array(position), np.zeros(names)))
        assert pipe.run() is MessageStatus.NEW
        moved.append((state.version("position") - before[0], state.version("velocity") - before[1]))
    assert moved == [(1, 0), (0, 0), (1, 0), (1, 0)]


@pytest.mark.parametrize(("function", "written"), [("state", "state"), ("motor", "motor"), ("reference", "command")])
@pytest.mark.parametrize(
    "fields",
    [
        ("position",),
        ("velocity", "effort"),
        ("position", "velocity", "effort"),
        ("acceleration", "stiffness", "bias", "velocity"),
    ],
)
def test_any_interfaces_pass_between_robots(context, function, written, fields):
    """A sender and a receiver of one record copy exactly the listed fields, and no other State changes.

    Acceleration, stiffness and a component's own field pass as well.
    """
    interface = {field: True for field in fields}
    mine, theirs = context.robot, make_robot()
    source, target = (getattr(robot, written) for robot in (mine, theirs))
    for state in (source, target):
        state.add("bias")
    there = PipeContext(theirs, context.middleware, {}, RATE)
    tags = {"interface": interface, "function": function}
    sender = factory.controller(published(**tags), context)
    receiver = factory.feedback(received(**tags, **({"message": None} if "bias" in fields else {})), there)
    assert receiver.run() is MessageStatus.NONE
    names = {field: field for field in (*fields, "position", "velocity")} | {"effort": "torque"}
    random = np.random.default_rng(2)
    for name in names.values():
        source[name] = random.standard_normal(mine.size)
    sender.collect()
    sender.send(0.5)
    assert receiver.run() is MessageStatus.NEW
    for field, name in names.items():
        expected = source[name] if field in fields else np.zeros(mine.size)
        assert_allclose(target[name], expected, atol=0.0)
    for untouched in {"state", "motor", "command"} - {written}:
        state = getattr(theirs, untouched)
        assert not state.position.any() and not state.velocity.any() and not state.torque.any()


def test_the_motor_side_has_joints_only():
    for record, more in ((BodyFeedbackRecord, {"source": "base"}), (BodyControllerRecord, {"sink": "base"})):
        with pytest.raises(ValidationError, match="the motor side in OPERATIONAL space"):
            record.model_validate(
                {
                    "name": "pipe",
                    "space": "OPERATIONAL",
                    "dofs": dofs(type="body", name="arm"),
                    "interface": {"position": True},
                    "function": "motor",
                }
                | more
            )


def test_a_feedback_is_filtered_in_every_cycle(context):
    writer = context.middleware.writer("joints", "solfer/JointCommand")
    pipe = factory.feedback(received(dofs=dofs(type="actuated"), filter=FILTER), context)
    state, seen = context.robot.command, []
    news = {0: 3.0, 1: 4.0, 5: 1.0, 6: 2.0}
    for cycle in range(12):
        if cycle in news:
            writer.write(JointMessage(("roll", "shoulder"), np.array((news[cycle], 1.0))))
        pipe.run()
        seen.append(state.position[6])
    held = [3.0, 4.0, 4.0, 4.0, 4.0, 1.0] + 6 * [2.0]
    assert_allclose(seen, low_passed(held, **FILTER), atol=1e-12)
    assert_allclose(state.position[7], 1.0, atol=1e-12)


def test_a_refused_message_does_not_reach_the_filter(context):
    writer = context.middleware.writer("joints", "solfer/JointCommand")
    pipe = factory.feedback(received(dofs=dofs(type="actuated"), filter=FILTER), context)
    for position in (1.0, np.nan, 1.0):
        writer.write(JointMessage(("roll", "shoulder"), np.array((1.0, position))))
        pipe.run()
        assert_allclose(context.robot.command.position[6:], 1.0, atol=1e-12)
    assert (pipe.accepted, pipe.refused) == (2, 1)


def test_the_filter_keeps_what_a_message_leaves_out(context):
    writer = context.middleware.writer("joints", "solfer/JointCommand")
    pipe = factory.feedback(received(dofs=dofs(type="actuated"), filter=FILTER), context)
    for names, values in ((("roll", "shoulder"), (1.0, 2.0)), *[(("roll",), (1.0,))] * 50):
        writer.write(JointMessage(names, np.array(values)))
        pipe.run()
        assert_allclose(context.robot.command.position[6:], (1.0, 2.0), atol=1e-12)


def test_a_reset_restarts_the_filter(context):
    pipe = factory.controller(published(filter=FILTER), context)
    positions, seen = [1.0, 2.0, 0.0, 0.0, 5.0], []
    for value in positions:
        context.robot.command.position[6] = value
        pipe.collect()
        seen.append(pipe.message.position[6])
    assert_allclose(seen, low_passed(positions, **FILTER), atol=1e-12)
    pipe.reset()
    context.robot.command.position[6] = -3.0
    pipe.collect()
    assert_allclose(pipe.message.position[6], -3.0, atol=1e-12)


def test_a_filter_needs_run_and_a_low_frequency(context):
    pipe = factory.controller(published(filter={"run": False, "frequency": 500.0}), context)
    context.robot.command.position[6] = 1.0
    pipe.collect()
    context.robot.command.position[6] = 2.0
    pipe.collect()
    assert pipe.message.position[6] == 2.0
    with pytest.raises(ConfigError, match="cut-off frequency of 500 Hz at 200 steps a second"):
        factory.controller(published(filter={"frequency": 500.0}), context)


@pytest.mark.parametrize(
    "make, changes, error, match",
    [
        (received, {"interface": {"bais": True}}, UnknownName, "unknown interface 'bais'\n  did you mean: bias"),
        (published, {"interface": {"bais": True}}, UnknownName, "did you mean: bias"),
        (received, {"interface": {"short": True}}, PipeError, "'short' has 3 numbers\n  expected: one for each DoF"),
        (received, {"interface": {"bias": True}, "message": "sensor_msgs/JointState"}, PipeError, "carries no 'bias'"),
        (published, {"interface": {"bias": True}, "type": "impedance", "sink": None}, PipeError, "takes no 'bias'"),
        (published, {"interface": {"stiffness": True}, "type": "velocity", "sink": None}, PipeError, "no 'stiffness'"),
        (received, {"interface": {"bias": True}, "space": "OPERATIONAL", "dofs": dofs(type="body", name="arm")},
         PipeError, "carries no 'bias': it carries a link"),
    ],
)  # fmt: skip
def test_interfaces_that_cannot_travel_are_refused(context, make, changes, error, match):
    context.robot.command.add("bias")
    context.robot.command.add("short", 3)
    with pytest.raises(error, match=match):
        (factory.feedback if make is received else factory.controller)(make(**changes), context)


def test_torque_travels_as_effort():
    with pytest.raises(ValidationError, match="expected effort: true"):
        received(interface={"torque": True})


@pytest.mark.parametrize(
    "make, changes, match",
    [
        (received, {"calibrate": True}, "'calibrate' is for rigid bodies"),
        (published, {"type": "impedance", "function": "state"}, "cannot be sent measurements"),
        (published, {"type": "impedance", "space": "OPERATIONAL", "dofs": dofs(type="body", name="arm")},
         "lower level in OPERATIONAL space; it has joints only"),
    ],
)  # fmt: skip
def test_pipes_that_contradict_themselves_are_refused(make, changes, match):
    with pytest.raises(ValidationError, match=match):
        make(**changes)


def test_interfaces_distinguish_records():
    bias, other = (received(interface={name: True}) for name in ("bias", "other"))
    assert bias != other and bias == received(interface={"bias": True}) and hash(bias) != hash(other)


def test_only_measured_states_have_a_history():
    with pytest.raises(ValidationError, match="'history' is for measured States"):
        received(history=8)
    with pytest.raises(ValidationError):
        received(function="state", history=1)
