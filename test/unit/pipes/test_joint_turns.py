"""Drivers that count continuous joints within a turn, on and on, or from any multiple of a turn."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from support.unit.joint_pipes import RATE, dofs, make_robot, published, received

from solfer.config.records.calibration import CalibrationRecord
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.transport import JointMessage

TOPIC = "joints"
NAMES = ("roll", "shoulder")


def wrapped(angle):
    """Count in (-pi, pi]."""
    return math.pi - (math.pi - angle) % math.tau


DRIVERS = {
    "wraps": wrapped,
    "begins at zero": lambda angle: angle % math.tau,
    "begins at another angle": lambda angle: 1.0 + (angle - 1.0) % math.tau,
    "counts on": lambda angle: angle,
    "begins anywhere": lambda angle: angle + math.tau * float(np.random.default_rng(7).integers(-50, 50)),
}


def scene(**changes):
    """Make a pipe that measures both joints, one that commands them, and what publishes."""
    bus = Bus()
    context = PipeContext(make_robot(), MemoryMiddleware(bus, "cart"), {}, RATE)
    measured = dofs(type="actuated")
    pipe = factory.feedback(received(dofs=measured, function="state", **changes), context)
    command = factory.controller(published(dofs=measured, sink="out"), context)
    writer = context.middleware.writer(TOPIC, "solfer/JointCommand")

    def measure(roll, shoulder=0.0, names=NAMES):
        bus.time += 1.0 / RATE
        writer.write(JointMessage(names, np.array((roll, shoulder)[: len(names)])))
        pipe.run()
        return float(context.robot.state.position[6])

    return SimpleNamespace(measure=measure, pipe=pipe, command=command, robot=context.robot, bus=bus, context=context)


def motion(count=800, seed=3):
    """Angles that go forth and back over several turns."""
    draw = np.random.default_rng(seed)
    return np.cumsum(0.04 * np.sin(np.arange(count) * 0.02) + draw.uniform(-0.005, 0.02, count))


@pytest.mark.parametrize("count", DRIVERS.values(), ids=DRIVERS)
def test_all_drivers_give_the_same_motion(count):
    made = scene()
    angles = motion()
    assert np.ptp(angles) > math.tau
    seen = [made.measure(count(angle)) for angle in angles]
    assert np.subtract(seen, seen[0]) == pytest.approx(angles - angles[0], abs=1e-9)
    assert seen[0] == count(angles[0])


@pytest.mark.parametrize("count", DRIVERS.values(), ids=DRIVERS)
def test_a_command_is_near_what_its_driver_measures(count):
    made = scene()
    for angle in motion():
        raw = count(angle)
        made.robot.command.position[6] = made.measure(raw) + 0.1
        made.command.collect()
        made.command.send(0.0)
        assert made.command.sent.position[0] == pytest.approx(raw + 0.1, abs=1e-9)
        assert made.command.to_receiver("position", made.robot.state.position[[6, 7]])[0] == pytest.approx(raw)


def test_joints_with_ends_do_not_turn():
    made = scene()
    made.measure(0.0, -1.9)
    made.bus.time += 5.0
    made.measure(0.0, 1.9)
    assert made.robot.state.position[7] == 1.9


def test_turns_count_over_messages_that_lack_the_joint():
    made = scene()
    made.measure(3.1)
    made.measure(0.0, names=("shoulder",))
    assert made.measure(-3.1) == pytest.approx(math.tau - 3.1)


def test_a_refused_message_does_not_count():
    made = scene()
    made.measure(0.1)
    assert made.measure(3.1) == 0.1  # 600 rad/s
    assert made.measure(-0.1) == pytest.approx(-0.1, abs=1e-12)


def test_a_driver_that_counts_on_may_pause():
    made = scene()
    for angle in np.arange(0.0, 7.0, 0.04):
        made.measure(angle)
    made.bus.time += 2.0
    assert made.measure(11.0) == 11.0


def test_a_start_keeps_the_count():
    made = scene()
    made.measure(3.1)
    made.measure(-3.1)
    made.pipe.restart()
    assert made.measure(-3.0) == pytest.approx(math.tau - 3.0)


def test_a_reference_is_in_the_count_of_the_driver():
    made = scene()
    listener = factory.feedback(received(dofs=dofs(type="actuated"), source="out"), made.context)
    for angle in motion():
        made.robot.command.position[6] = desired = made.measure(wrapped(angle)) + 0.1
        made.command.collect()
        made.command.send(0.0)
        made.robot.command.position[6] = 0.0
        listener.run()
        assert made.robot.command.position[6] == pytest.approx(desired, abs=1e-9)


@pytest.mark.parametrize(("begin", "is_alone"), [(0.0, False), (40.0, True)])
def test_the_motor_side_has_a_count_of_its_own(begin, is_alone):
    made = scene()
    motor = factory.feedback(received(dofs=dofs(type="actuated"), source="motors", function="motor"), made.context)
    writer = made.context.middleware.writer("motors", "solfer/JointCommand")
    for angle in motion() + begin:
        if not is_alone:
            made.measure(wrapped(angle))
        writer.write(JointMessage(NAMES, np.array((angle, 0.0))))
        motor.run()
        assert made.robot.motor.position[6] == angle


@pytest.mark.parametrize("is_link_first", [True, False])
@pytest.mark.parametrize("count", DRIVERS.values(), ids=DRIVERS)
@pytest.mark.parametrize("turns", [-17, 0, 3])
def test_the_motor_side_begins_on_the_turn_of_the_link_side(count, turns, is_link_first):
    """What lies between both sides is the deflection of the gear."""
    made = scene()
    motor = factory.feedback(received(dofs=dofs(type="actuated"), source="motors", function="motor"), made.context)
    writer = made.context.middleware.writer("motors", "solfer/JointCommand")
    deflections = []

    def measure_motor(angle):
        writer.write(JointMessage(NAMES, np.array((angle + math.tau * turns, 0.0))))
        motor.run()

    for angle in motion() + 3.0:
        if is_link_first:
            made.measure(count(angle))
            measure_motor(angle + 0.02)
        else:
            measure_motor(angle + 0.02)
            made.measure(count(angle))
        deflections.append(made.robot.motor.position[6] - made.robot.state.position[6])
    assert deflections[1:] == pytest.approx(np.full(799, 0.02), abs=1e-9)


@pytest.mark.parametrize("count", DRIVERS.values(), ids=DRIVERS)
@pytest.mark.parametrize("sign, offset", [(1, 3.1), (-1, -2.9), (1, 40.0)])
def test_a_calibrated_joint_begins_by_the_shortest_way_from_its_zero(count, sign, offset):
    """Commands are in the driver's count all the same."""
    made = scene()
    joints = {"roll": {"sign": sign, "offset": offset}, "shoulder": {}}
    context = made.context
    context.calibrations["encoders"] = CalibrationRecord.model_validate({"name": "encoders", "joints": joints})
    pipe = factory.feedback(
        received(dofs=dofs(type="actuated"), function="state", source="raw", calibration="encoders"), context
    )
    command = factory.controller(published(dofs=dofs(type="actuated"), calibration="encoders"), context)
    writer = context.middleware.writer("raw", "solfer/JointCommand")
    seen = []
    robot = made.robot
    angles = motion() + 0.3
    for angle in angles:
        made.bus.time += 1.0 / RATE
        raw = count(sign * angle + offset)
        writer.write(JointMessage(NAMES, np.array((raw, 0.0))))
        pipe.run()
        seen.append(robot.state.position[6])
        robot.command.position[6] = seen[-1] + 0.1
        command.collect()
        command.send(0.0)
        assert command.sent.position[0] == pytest.approx(raw + sign * 0.1, abs=1e-9)
    assert seen == pytest.approx(angles, abs=1e-9)
