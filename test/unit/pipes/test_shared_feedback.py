"""A feedback for several Robots."""

import numpy as np
from support.unit.endpoints import Told
from support.unit.joint_pipes import dofs, make_robot, received

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.pipes.shared_feedback import SharedFeedbackPipe, Source, Turns
from solfer.transport import JointMessage, MessageStatus


def make_pipe(robot):
    """Make the pipe that is shared."""
    context = PipeContext(robot, MemoryMiddleware(Bus(), "cart"), {}, 200.0)
    pipe = factory.feedback(received(dofs=dofs(type="actuated"), function="state"), context)
    pipe.reader = Told()
    return pipe


def test_patience_is_that_of_the_source(monkeypatch):
    robot, told = make_robot(), []
    pipe = make_pipe(robot)
    monkeypatch.setattr(pipe, "be_patient", lambda *patience: told.append(patience))
    SharedFeedbackPipe(Source(pipe), Turns(), robot.state.window(), True).be_patient(0.7, 9)
    assert told == [(0.7, 9)]


def test_a_restart_needs_every_part_again():
    robot, turns = make_robot(), Turns()
    pipe = make_pipe(robot)
    source = Source(pipe)
    state = robot.state.window()
    shared = SharedFeedbackPipe(source, turns, state, True)

    def publish(**positions):
        pipe.reader.publish(JointMessage(tuple(positions), np.array(list(positions.values()))))
        turns.next()
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
