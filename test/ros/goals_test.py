#!/usr/bin/env python3
"""Goals of a declared action have the states that actionlib's own server gives them, both on ROS."""

import os
import random
import sys
import time
import unittest
from contextlib import closing
from pathlib import Path

import rospy
import rostest
from actionlib.msg import TestActionGoal
from actionlib_msgs.msg import GoalID, GoalStatusArray
from system import SOAKS, START, wait_for

sys.path.insert(0, str(Path(os.path.realpath(__file__)).parents[1]))

from support.unit.goal_sequences import (  # noqa: E402
    EVENTS,
    Clients,
    endless_action,
    reference_server,
    ros_message,
    states,
)

from solfer.middleware.ros import RosMiddleware, RosNode  # noqa: E402
from solfer.transport.declared.action_server import ActionServer  # noqa: E402

SEQUENCES, LENGTH, SEED = 20 if SOAKS else 4, 4, 2026
TICK = 0.1
"""Time between two events [s]."""

SERVERS = {"ours": "/goals/node/action", "theirs": "/goals/reference"}
"""Names of the actions."""


class GoalsTest(unittest.TestCase):
    """Both servers in this process, each with publishers and subscribers of its own."""

    def test_drawn_sequences_have_the_states_of_actionlib(self):
        rospy.set_param(f"{SERVERS['theirs']}/status_list_timeout", 10.0 * START)
        draw, self.found = random.Random(SEED), {}
        with closing(RosMiddleware(RosNode("goals"))) as middleware:
            self.server = ActionServer(SERVERS["ours"][1:].rpartition("/")[0], endless_action("action"), middleware)
            reference_server(SERVERS["theirs"])
            for which, name in SERVERS.items():
                rospy.Subscriber(f"{name}/status", GoalStatusArray, self.keep, which)
            for number in range(SEQUENCES):
                self.play([draw.choice(EVENTS) for _ in range(LENGTH)], f"_{number}")

    def keep(self, message, which):
        """Keep the newest states of one server."""
        self.found[which] = states(message.status_list)

    def play(self, sequence, mark):
        """Publish a sequence that begins with a goal, to both servers, and compare after each event."""
        clients, publishers = Clients(TICK), self.connect()
        for event in ("goal", *sequence):
            sent = clients.act(event, rospy.get_time())
            if sent is None:
                for publisher in publishers:
                    publisher.unregister()
                publishers = self.connect()
            else:
                topic, name = sent
                message = ros_message(topic, name)
                marked = message if topic == "cancel" else message.goal_id
                marked.id += mark if marked.id else ""
                for publisher in publishers:
                    if publisher.resolved_name.endswith(topic):
                        publisher.publish(message)
            self.cycle_for(TICK)
            wait_for(lambda: self.agree(mark), START, lambda: f"one outcome of {sequence}: {self.found}")
        for publisher in publishers:
            publisher.unregister()

    def connect(self):
        """Make the publishers of a client."""
        made = [
            rospy.Publisher(f"{name}/{topic}", kind, queue_size=10)
            for name in SERVERS.values()
            for topic, kind in (("goal", TestActionGoal), ("cancel", GoalID))
        ]
        wait_for(lambda: all(each.get_num_connections() for each in made), START, "both servers")
        return made

    def agree(self, mark):
        """Whether both servers have the same goals of a sequence in the same states."""
        self.cycle_for(0.02)
        of_sequence = [
            {name: state for name, state in self.found.get(which, {}).items() if name.endswith(mark)}
            for which in SERVERS
        ]
        return of_sequence[0] == of_sequence[1] != {}

    def cycle_for(self, duration):
        """Let our server work so long [s]."""
        end = time.monotonic() + duration
        while time.monotonic() < end:
            self.server.receive("")
            self.server.publish()
            time.sleep(0.005)


if __name__ == "__main__":
    rostest.rosrun("solfer", "goals", GoalsTest)
