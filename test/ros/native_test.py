#!/usr/bin/env python3
"""A component in C++ under ROS: what it receives makes its twin in Python send the same, and a crash ends its node."""

import os
import signal
import sys
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from recording import Recording
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool
from system import START, end, program, started, wait_for

sys.path.append(str(Path(os.path.realpath(__file__)).parents[1]))
from support.native import JointSpaceTwin, build  # noqa: E402
from support.plugins.plugin import configuration  # noqa: E402

from solfer_tools.cli.main import main  # noqa: E402

TOPIC = "/position_controller/command"


class NativeTest(unittest.TestCase):
    """A simulated robot in lock-step with one plugin."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.library = build(self.folder / "libcomponents.so")
        self.recording = Recording((TOPIC,))
        self.addCleanup(self.recording.close)

    def simulate(self, *arguments):
        """Start the robot."""
        self.enterContext(started(*program("simulator", *arguments)))

    def plugin(self, *arguments, **tags):
        """Start the plugin `test` with a component of the library."""
        file = configuration(self.folder, **tags)
        path = os.pathsep.join([str(Path(os.path.realpath(__file__)).parents[1]), os.environ.get("PYTHONPATH", "")])
        return started(*program("plugin", "-p", "test", "-c", str(file), *arguments), PYTHONPATH=path)

    def step(self):
        """Newest step of the simulation."""
        return max(self.recording.joints, default=0)

    def test_its_twin_sends_the_same_for_its_recording(self):
        """Its topic and its service are those of C++, too."""
        rospy.set_param("/lockstep", "test")
        self.addCleanup(rospy.delete_param, "/lockstep")
        self.simulate("--factor", "0")
        run = self.folder / "run.mcap"
        tags = {"dynamics": True, "kinematics": True, "joints": "arms"}
        with self.plugin("--record", str(run), **{"class": f"{self.library}::JointSpace"}, **tags) as node:
            zero = rospy.ServiceProxy("/test/zero", SetBool)
            zero.wait_for_service(START)
            wait_for(lambda: len(self.recording.commanded(TOPIC, "/test")) > 100, START, "commands")
            rospy.Publisher("/test/offset", Float64MultiArray, queue_size=1, latch=True).publish(data=[0.1, 0.2])
            self.assertTrue(zero(True).success)
            refused = zero(False)
            self.assertFalse(refused.success)
            self.assertIn("nothing to do without `data`", refused.message)
            last = self.step() + 500
            wait_for(lambda: self.step() > last, START, "half a second")
            wait_for(run.exists, START, "the process that writes the recording")
            code, output = end(node, signal.SIGTERM)
            self.assertEqual(code, 0, output)
        twin = configuration(self.folder, **{"class": f"{JointSpaceTwin.__module__}:{JointSpaceTwin.__name__}"}, **tags)
        self.assertEqual(main(["replay", str(run), "-n", "test", "-c", str(twin)]), 0)

    def test_a_crash_ends_its_node_and_the_robot_is_held(self):
        """Its node ends as by `kill -9`."""
        self.simulate()
        with self.plugin(**{"class": f"{self.library}::Failing"}, how="segfault", after=100) as node:
            wait_for(lambda: node.poll() is not None, START, "a crash")
            self.assertEqual(node.wait(), -signal.SIGSEGV)
        begin = self.step()
        before = self.recording.joints[begin][0]
        wait_for(lambda: self.step() > begin + 300, START, "time that goes on")
        self.assertLess(abs(self.recording.joints[begin + 300][0] - before).max(), 0.06)


if __name__ == "__main__":
    rospy.init_node("native_test")
    rostest.rosrun("solfer", "native", NativeTest, sys.argv)
