"""A feedback for several Robots."""

import numpy as np
from endpoints import Told
from test_joint_pipes import dofs, heard, make_robot

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import JointMessage, Status, Surroundings, factory
from solfer.pipes.shared import SharedFeedback, Source, Turns


def test_of_a_sender_that_tells_parts_everything_has_to_come_again_after_a_new_start():
    robot, turns = make_robot(), Turns()
    surroundings = Surroundings(robot, MemoryMiddleware(Bus(), "cart"), {}, 200.0)
    pipe = factory.feedback(heard(dofs=dofs(type="actuated"), function="state"), surroundings)
    pipe.reader = Told()
    source = Source(pipe)
    state = robot.state.window()
    shared = SharedFeedback(source, turns, state, True)

    def tell(**positions):
        pipe.reader.tell(JointMessage(tuple(positions), np.array(list(positions.values()))))
        turns.next()
        return shared.run()

    assert tell(roll=0.1) is Status.NEW and not shared.heard
    assert tell(shoulder=0.2) is Status.NEW and shared.heard
    shared.restart()
    assert tell(roll=0.3) is Status.NEW and not shared.heard and pipe.heard
    assert tell(shoulder=0.4) is Status.NEW and shared.heard
    shared.restart()
    assert tell(roll=0.5, shoulder=0.6) is Status.NEW and shared.heard
    turns.next()
    assert shared.run() is Status.OLD
    version = state.version("position")
    assert tell(roll=0.5, shoulder=0.6) is Status.NEW and state.version("position") == version  # nothing has changed
    assert tell(roll=0.5, shoulder=0.7) is Status.NEW and state.version("position") == version + 1
