"""A feedback for several Robots."""

import numpy as np
import pytest
from support.unit.endpoints import StandInReader
from support.unit.joint_pipes import dofs, make_robot, received

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.pipes.sharing.cached_feedback import CachedFeedback, CycleCount
from solfer.transport import JointMessage, MessageStatus


def record(**changes):
    return received(dofs=dofs(type="actuated"), function="state", initialize=True, **changes)


def make_pipe(robot, **changes):
    """Make the pipe that is shared."""
    context = PipeContext(robot, MemoryMiddleware(Bus(), "cart"), {}, 200.0)
    pipe = factory.feedback(record(**changes), context)
    pipe.reader = StandInReader()
    return pipe


def test_patience_is_that_of_the_source(monkeypatch):
    timeouts, pipe = [], make_pipe(make_robot())
    monkeypatch.setattr(pipe, "set_timeout", lambda *patience: timeouts.append(patience))
    source = CachedFeedback(pipe, CycleCount())
    for patience in ((0.7, 9), (0.5, 10)):  # the most patient plugin counts
        source.share(record()).set_timeout(*patience)
    assert timeouts == [(0.7, 9), (0.7, 10)]


@pytest.mark.parametrize("ended", ["roll", "shoulder"])
def test_each_plugin_needs_the_drivers_of_its_own_joints(ended):
    """Each joint has a driver; the one that ends is a timeout of the plugin alone that commands this joint."""
    robot, turns, bus, names = make_robot(), CycleCount(), Bus(), ("roll", "shoulder")
    pipe = factory.feedback(record(), PipeContext(robot, MemoryMiddleware(bus, "cart"), {}, 200.0))
    source = CachedFeedback(pipe, turns)
    shares = {name: source.share(record()) for name in names}
    writers = {name: MemoryMiddleware(bus, f"driver_of_{name}").writer("joints", pipe.reader.carries) for name in names}
    for name, share in shares.items():
        share.require(np.array([robot.dofs.index(name)]))
    for tick in range(5):
        bus.run_until(0.1 * tick)
        for name, writer in writers.items():
            if tick < 2 or name != ended:
                writer.write(JointMessage((name,), np.array([0.01 * tick])))
        turns.next()
        for share in shares.values():
            share.run()
    assert {name: share.arrival for name, share in shares.items()} == {
        name: pytest.approx(0.1 if name == ended else 0.4) for name in names
    }
    assert shares[ended].silent == f"driver_of_{ended}"


def test_a_restart_needs_every_part_again():
    """Joints come in separate messages: one part of an earlier message must not complete a new start."""
    robot, turns = make_robot(), CycleCount()
    pipe = make_pipe(robot)
    source = CachedFeedback(pipe, turns)
    state = robot.state.window()
    shared, other = source.share(record()), source.share(record())

    def publish(**positions):
        pipe.reader.publish(JointMessage(tuple(positions), np.array(list(positions.values()))))
        turns.next()
        other.run()
        return shared.run()

    assert publish(roll=0.1) is MessageStatus.NEW and not shared.received
    assert publish(shoulder=0.2) is MessageStatus.NEW and shared.received
    shared.restart()
    assert publish(roll=0.3) is MessageStatus.NEW and not shared.received and pipe.received
    assert publish(shoulder=0.4) is MessageStatus.NEW and shared.received
    shared.restart()
    assert publish(roll=0.5, shoulder=0.6) is MessageStatus.NEW and shared.received
    turns.next()
    assert shared.run() is MessageStatus.OLD
    version = state.version("position")
    assert (
        publish(roll=0.5, shoulder=0.6) is MessageStatus.NEW and state.version("position") == version
    )  # nothing has changed
    assert publish(roll=0.5, shoulder=0.7) is MessageStatus.NEW and state.version("position") == version + 1
