#!/usr/bin/env python3
"""Two robots that drive in one graph, by the commands of their page: nothing of one reaches the other."""

import contextlib
import math
import re
import shlex
import signal
import unittest

import rosgraph
import rospy
import rostest
from nav_msgs.msg import Odometry
from ros_tools import shown
from system import NODES, START, end, started, wait_for
from tf2_msgs.msg import TFMessage

from solfer.srv import ListControllers

PAGE = NODES.parent / "docs/how-to/ros_tools.md"
GOALS = {"red": (0.2, 0.0), "blue": (0.0, 0.15)}
"""Where the page sends the robots, x and y [m]."""

SHARED = ("/rosout", "/rosout_agg", "/tf", "/tf_static")
"""Topics without a namespace."""

LAUNCHED = ("/rosdistro", "/roslaunch/", "/rosversion", "/run_id", "/tcp_keepalive", "/use_sim_time")
"""Parameters of roslaunch, of rostest and of all nodes."""

STANDS = 5e-3
"""How far the base of a robot that stands moves at most [m]."""


class TwoRobotsTest(unittest.TestCase):
    """What the page promises; one robot is red, the other one blue."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.places, cls.frames = {}, {}
        for topic in ("/tf", "/tf_static"):
            rospy.Subscriber(topic, TFMessage, cls.keep_frames, queue_size=100)
        for robot in GOALS:
            rospy.Subscriber(f"/{robot}/floating_base", Odometry, cls.keep_place, robot, queue_size=1, tcp_nodelay=True)
        cls.commands = re.findall(r"^ros.*[=/](?:red|blue)\b.*$", PAGE.read_text(), re.MULTILINE)

    @classmethod
    def keep_frames(cls, message):
        """Keep the parent of each frame."""
        cls.frames |= {each.child_frame_id: each.header.frame_id for each in message.transforms}

    @classmethod
    def keep_place(cls, message, robot):
        """Keep where the base of a robot is in truth, x and y [m]."""
        cls.places[robot] = message.pose.pose.position.x, message.pose.pose.position.y

    def test_each_robot_goes_its_own_way(self):
        """The commands of the page: each of two robots drives, stops and ends while the other one is not affected."""
        *launches, red_goes, blue_goes, blue_drives, stop = map(shlex.split, self.commands)
        with contextlib.ExitStack() as stack:
            red, blue = (stack.enter_context(started(*each)) for each in launches)
            wait_for(lambda: set(self.places) == set(GOALS), 2.0 * START, "two robots that measure")
            ways = [stack.enter_context(started(*each)) for each in (red_goes, blue_goes)]
            for way in ways:
                output, _ = way.communicate(timeout=2.0 * START)
                self.assertEqual(way.returncode, 0, output)
            for robot, goal in GOALS.items():
                self.assertLess(math.dist(self.places[robot], goal), 0.02, (robot, self.places))
            self.nothing_crosses()
            stands = self.places["red"]
            stack.enter_context(started(*blue_drives))
            self.blue_drives()
            self.assertLess(math.dist(self.places["red"], stands), STANDS)
            self.assertTrue(shown(*stop)["success"])
            self.blue_drives()
            self.assertEqual([self.owners(robot) for robot in GOALS], [[], 2 * ["/blue/wheeled_motion"]])
            code, output = end(red, signal.SIGINT)
            self.assertEqual(code, 0, output)
            self.assertEqual([name for name in self.nodes() if name.startswith("/red/")], [])
            self.blue_drives()
            self.assertEqual(set(self.owners("blue")), {"/blue/wheeled_motion"})
            code, output = end(blue, signal.SIGINT)
            self.assertEqual(code, 0, output)

    def blue_drives(self):
        """Wait until the blue robot has gone 0.05 m further."""
        begin = self.places["blue"]
        wait_for(lambda: math.dist(self.places["blue"], begin) > 0.05, START, "a blue robot that drives")

    @staticmethod
    def nodes():
        """Return the names of all nodes, of each topic and service."""
        state = rosgraph.Master(rospy.get_name()).getSystemState()
        return sorted({node for kind in state for _, nodes in kind for node in nodes})

    @staticmethod
    def owners(robot):
        """Return the names of the nodes that own joints of a robot."""
        claims = rospy.ServiceProxy(f"/{robot}/lower_level/list_controllers", ListControllers)().claimed_by
        return re.findall(r"(/\S+):", " ".join(claims))

    def nothing_crosses(self):
        """Check topics, services, parameters, claims and frames."""
        master = rosgraph.Master(rospy.get_name())
        for kind in master.getSystemState():
            for name, nodes in kind:
                others = [node for node in nodes if node not in (rospy.get_name(), "/rosout")]
                if name not in SHARED:
                    own = "/".join(name.split("/")[:2]) + "/"
                    self.assertEqual([node for node in others if not node.startswith(own)], [], name)
        places = (*(f"/{robot}/" for robot in GOALS), *LAUNCHED)
        self.assertEqual([name for name in rospy.get_param_names() if not name.startswith(places)], [])
        for robot in GOALS:
            self.assertEqual(set(self.owners(robot)), {f"/{robot}/wheeled_motion"})
            parents = {parent for child, parent in self.frames.items() if child.startswith(f"{robot}/")}
            self.assertEqual({each for each in parents if not each.startswith(f"{robot}/")}, {"world"})
            self.assertEqual({f"{robot}/pelvis", f"{robot}/wheel_1", f"{robot}/arm1_8"} - set(self.frames), set())
        links = [{child.partition("/")[2] for child in self.frames if child.startswith(robot)} for robot in GOALS]
        self.assertEqual(links[0], links[1])
        self.assertEqual([child for child in self.frames if child.partition("/")[0] not in GOALS], [])


if __name__ == "__main__":
    rostest.rosrun("solfer", "two_robots", TwoRobotsTest)
