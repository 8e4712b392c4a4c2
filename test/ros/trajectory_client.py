#!/usr/bin/env python3
"""Our own client of the action of trajectories: sends one goal that takes long, and prints each state that it gets."""

import time
from contextlib import closing

from solfer.interfaces import trajectories as messages
from solfer.middleware.ros import RosMiddleware, RosNode, run_main
from solfer.transport.declared import ActionClient, Goal

AGAIN = 2.0
"""Time after which a goal that nobody has taken is sent again [s]."""


def goal() -> messages.FollowGoal:
    """Make a goal that moves the neck slowly."""
    points = (messages.TrajectoryPoint((0.3, 0.2), (0.0, 0.0), time_from_start=30.0),)
    return messages.FollowGoal(messages.JointTrajectory(joint_names=("neck_yaw", "neck_pitch"), points=points))


def taken(client: ActionClient) -> Goal:
    """Send the goal until the owner of the action has it."""
    while True:
        sent, patience = client.send(goal()), time.monotonic() + AGAIN
        while time.monotonic() < patience:
            client.poll()
            if sent.known or sent.status.ended:
                return sent
            time.sleep(0.01)


def main(argv: list[str]) -> int:
    """Run until the goal has ended."""
    with closing(RosMiddleware(RosNode("trajectory_client", argv))) as middleware:
        name = "joint_states/follow_joint_trajectory"
        types = (messages.FollowGoal, messages.FollowFeedback)
        client = ActionClient(middleware, name, messages.FOLLOW, *types, result=messages.FollowResult)
        sent, printed = taken(client), None
        while middleware.running():
            client.poll()
            if sent.status is not printed and (sent.feedback is not None or sent.status.ended):
                printed = sent.status
                print(printed.name, flush=True)
            if sent.status.ended:
                break
            time.sleep(0.01)
    return 0


if __name__ == "__main__":
    run_main(main)
