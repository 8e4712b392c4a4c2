#!/usr/bin/env python3
"""Fig. 4 of the paper: whichever of its plugins dies in motion, the robot stays up, and goes on when it is back."""

import functools
import subprocess
import unittest
from collections.abc import Callable

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from system import CENTAURO, START, Robot, move, program, started, wait_for

from solfer.robot import Robot as Model
from solfer.srv import MoveJoints, MoveJointsResponse

PARTS = {"upper_body": ("torso_yaw", "j_arm1_4"), "lower_body": ("ankle_yaw_1", "ankle_yaw_2")}
MOTION, SPEED = 0.4, 0.2  # [rad], [rad/s]
UP = 0.05
"""How far the base may sink while a plugin is away [m]."""

LIMIT = 0.5
"""Share of its speed limit that no joint reaches, whatever dies and comes back: what is asked for needs up to 0.05, and
the merging plugin catches up with it at 0.2, with springs that swing by some percent."""

OBITUARIES = {
    "upper_body": ("/whole_body", "feedback 'upper_body' (/upper_body): nothing new for"),
    "lower_body": ("/whole_body", "feedback 'lower_body' (/lower_body): nothing new for"),
    "whole_body": ("/simulator", "the lease of '/whole_body' has timed out"),
}
"""Node and text of its report when a plugin has died."""


class KillsTest(unittest.TestCase):
    """All tests have one robot and its three plugins; each kills one, and leaves it as it was."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("kills_test")
        cls.enterClassContext(started(*program("simulator")))
        cls.robot, cls.log, cls.health = Robot(), [], {}
        model = Model.load(rospy.get_param("/robot_description"), rospy.get_param("/robot_semantic_description"))
        cls.limits = dict(zip(model.dofs, model.upper_limits.velocity, strict=True))
        cls.fastest: dict[str, float] = {}
        rospy.Subscriber("/joint_states", JointState, cls.receive_speeds, queue_size=1000, tcp_nodelay=True)
        rospy.Subscriber("/rosout", Log, lambda message: cls.log.append((message.name, message.msg)), queue_size=1000)
        rospy.Subscriber(
            "/diagnostics",
            DiagnosticArray,
            lambda message: cls.health.update(
                {status.name: (message.header.stamp, status.message) for status in message.status}
            ),
            queue_size=100,
        )
        cls.nodes: dict[str, subprocess.Popen] = {}
        for name in (*PARTS, "whole_body"):
            cls.start(name)

    @classmethod
    def start(cls, plugin: str) -> None:
        """Start a plugin, which ends with the tests."""
        cls.nodes[plugin] = cls.enterClassContext(started(*program("plugin", "-p", plugin, "-c", str(CENTAURO))))

    @classmethod
    def receive_speeds(cls, message: JointState) -> None:
        """Keep the largest share of its speed limit that any joint has used."""
        for name, speed in zip(message.name, message.velocity, strict=True):
            cls.fastest[name] = max(cls.fastest.get(name, 0.0), abs(speed) / cls.limits[name])

    def is_slow(self) -> None:
        """No joint has come near its speed limit."""
        worst = max(self.fastest, key=self.fastest.get)
        self.assertLess(self.fastest[worst], LIMIT, worst)

    def is_published(self, victim: str) -> bool:
        """Return whether a node that has survived reports that a plugin has died."""
        witness, words = OBITUARIES[victim]
        return any(name == witness and words in text for name, text in list(self.log))

    def height(self) -> float:
        """Of the base [m]."""
        return self.robot.odometry[-1].pose.pose.position.z

    def runs(self, plugin: str, since: rospy.Time) -> bool:
        """Return whether a plugin has reported that it runs."""
        stamp, summary = self.health.get(f"{plugin}: {plugin}", (since, ""))
        return stamp > since and summary == "running"

    def ask(self, plugin: str, **fields: object) -> MoveJointsResponse:
        """Ask a plugin for a motion until it accepts."""
        answer, reply = "no service", None

        def accepts() -> bool:
            nonlocal answer, reply
            try:
                reply = rospy.ServiceProxy(f"/{plugin}/trajectory", MoveJoints)(**fields)
            except rospy.ServiceException as error:
                answer = str(error)
                rospy.rostime.wallsleep(0.1)
                return False
            answer = reply.message
            return reply.success

        wait_for(accepts, START, lambda: f"{plugin} accepts a motion: {answer}")
        return reply

    def swing(
        self, plugin: str, home: dict[str, float], distance: float, arrive: Callable[[dict[str, float], float], None]
    ) -> None:
        """Move joints of a plugin's part to a distance from home [rad]; `arrive` waits for what shall come of it."""
        goals = {joint: home[joint] + distance for joint in PARTS[plugin]}
        move(
            functools.partial(arrive, goals),
            functools.partial(self.ask, plugin),
            joints=list(goals),
            positions=list(goals.values()),
            speed=SPEED,
        )

    def begin(self, goals: dict[str, float], timeout: float) -> None:
        """Wait until joints are on their way to goals that are MOTION away."""
        wait_for(
            lambda: all(
                abs(self.robot.positions()[joint] - goal) < 7.0 / 8.0 * MOTION for joint, goal in goals.items()
            ),
            timeout,
            f"motion of {', '.join(goals)}",
        )

    def kill_in_motion(self, victim: str) -> None:
        """Kill a plugin while both parts move, see that the robot stays up, start it again, and move back."""
        begin = rospy.Time.now()
        wait_for(lambda: self.runs("whole_body", begin), START, "all plugins")
        self.robot.settle()
        home, height = self.robot.positions(), self.height()
        self.fastest.clear()
        for part in PARTS:
            self.swing(part, home, MOTION, self.begin)
        self.log.clear()
        self.nodes[victim].kill()
        wait_for(lambda: self.is_published(victim), START, f"word of the death of {victim}")
        self.robot.settle()
        self.assertLess(abs(self.height() - height), UP)
        self.is_slow()
        self.start(victim)
        for arrive in (self.begin, self.robot.arrive):  # both parts move at once, and then both are there
            for part in PARTS:
                self.swing(part, home, 0.0, arrive)
            self.robot.settle()
        self.assertLess(abs(self.height() - height), UP)
        self.is_slow()

    def test_the_plugin_on_the_upper_body(self):
        self.kill_in_motion("upper_body")

    def test_the_plugin_on_the_lower_body(self):
        self.kill_in_motion("lower_body")

    def test_the_plugin_that_merges(self):
        self.kill_in_motion("whole_body")


if __name__ == "__main__":
    rostest.rosrun("solfer", "kills", KillsTest)
