#!/usr/bin/env python3
"""A real-time layer seen from ROS through its bridge, while one process after the other is killed."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import rospy
import rostest
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool
from system import START, ask, end, wait_for

from solfer.errors import MiddlewareError
from solfer.middleware.ros.launch import free_port
from solfer.middleware.xbot import Namespace
from solfer.middleware.xbot.board import Board

REPOSITORY = Path(__file__).resolve().parents[2]
WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")
LAYER = """
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {{file: {main}}}}}
executor: {{start: [joint_states], blend: 0.2, overruns: 1000000, schedule: {{priority: 0}}}}
"""


class XbotTest(unittest.TestCase):
    """Requests and topics that cross the bridge, and what a killed process leaves."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("xbot_test")
        cls.name = f"rostest-{os.getpid()}"
        cls.namespace = Namespace(cls.name)
        cls.folder = Path(tempfile.mkdtemp())
        cls.layer = cls.folder / "layer.yaml"
        cls.layer.write_text(LAYER.format(main=REPOSITORY / "config" / "centauro.yaml"))
        cls.processes, cls.told = {}, JointState()
        rospy.Subscriber("/joint_states", JointState, lambda message: setattr(cls, "told", message), queue_size=1)
        cls.start("xbot_simulator")
        wait_for(lambda: "robot_upper_body" in cls.namespace.present("parameters"), START, "the robot's parameters")
        cls.start("xbot", str(cls.layer))
        cls.start("xbot_bridge", str(cls.layer))

    @classmethod
    def tearDownClass(cls):
        for process in cls.processes.values():
            process.kill()
            process.wait()
        shutil.rmtree(cls.namespace.folder)
        shutil.rmtree(cls.folder)

    @classmethod
    def start(cls, node, *arguments, **environment):
        """Start a node of the layer, with what it prints going to a file."""
        with (cls.folder / f"{node}.log").open("a") as log:
            cls.processes[node] = subprocess.Popen(
                [sys.executable, str(REPOSITORY / "nodes" / node), *arguments, "--namespace", cls.name],
                stdout=log, stderr=subprocess.STDOUT, env=os.environ | environment)
        return cls.processes[node]

    def printed(self, node):
        """What a node has printed."""
        return (self.folder / f"{node}.log").read_text()

    def kill(self, node):
        """End a process as nothing else does."""
        self.processes[node].kill()
        self.processes[node].wait()

    def move(self, **request):
        """Ask `joint_states` of the layer until it does what is asked."""

        def done():
            try:
                return ask(**request).success
            except rospy.ServiceException:
                return False

        wait_for(done, START, lambda: f"a plugin that accepts requests: {self.printed('xbot')}")

    def of(self, field, joint):
        """The newest number of a joint that came through the bridge."""
        told = self.told
        return dict(zip(told.name, getattr(told, field), strict=True)).get(joint, float("nan"))

    def cycles(self):
        """Cycles that the layer has made; 0 while there is none."""
        try:
            return Board.attach(self.namespace.folder).counts[0]
        except MiddlewareError:
            return 0

    def turn(self, speed):
        """Turn the wheels, and wait until they do."""
        self.move(joints=WHEELS, velocities=[speed] * 4)
        wait_for(lambda: abs(self.of("velocity", WHEELS[0]) - speed) < 0.1, START, f"wheels at {speed:g} rad/s")

    def test_requests_go_in_and_what_is_measured_comes_out(self):
        self.move(joints=["torso_yaw"], positions=[0.3], speed=1.0)
        wait_for(lambda: abs(self.of("position", "torso_yaw") - 0.3) < 0.02, START, "torso_yaw at its goal")
        reply = ask(joints=["torso_yawn"], positions=[0.3])
        self.assertFalse(reply.success)
        self.assertIn("torso_yaw", reply.message)

    def test_the_bridge_is_killed_and_comes_back(self):
        self.turn(1.0)
        before = self.cycles()
        self.kill("xbot_bridge")
        wait_for(lambda: self.cycles() > before + 500, START, "a layer that goes on without its bridge")
        self.start("xbot_bridge", str(self.layer))
        self.turn(0.0)

    def test_the_layer_is_killed_and_comes_back(self):
        self.turn(1.0)
        self.kill("xbot")
        wait_for(lambda: abs(self.of("velocity", WHEELS[0])) < 0.1, START, "wheels that stand still")
        self.start("xbot", str(self.layer))
        self.turn(-1.0)
        self.turn(0.0)

    def test_the_plugin_is_switched_by_the_services_of_xbotcore(self):
        self.move(state="reset")
        switch = rospy.ServiceProxy("/xbotcore/joint_states_switch", SetBool)
        self.assertTrue(switch(False).success)
        wait_for(lambda: not ask(state="reset").success, START, "a plugin that is stopped")
        wait_for(lambda: switch(True).success, START, "a plugin that starts")
        self.move(state="reset")

    def test_a_master_that_starts_anew_ends_the_bridge_and_nothing_else(self):
        uri = f"http://localhost:{free_port()}"
        master = self.master(uri)
        self.kill("xbot_bridge")
        self.start("xbot_bridge", str(self.layer), ROS_MASTER_URI=uri)
        wait_for(lambda: self.offered(uri), START, "the layer's services")
        before = self.cycles()
        master.kill()
        master.wait()
        master = self.master(uri)
        killed = time.monotonic()
        self.assertEqual(self.processes["xbot_bridge"].wait(START), 2)
        self.assertLess(time.monotonic() - killed, 30.0)
        self.assertIn("error: the bridge ends:", self.printed("xbot_bridge"))
        self.assertGreater(self.cycles(), before)
        self.start("xbot_bridge", str(self.layer), ROS_MASTER_URI=uri)  # as launch/xbot.launch does
        wait_for(lambda: self.offered(uri), START, "the layer's services on the new master")
        self.assertEqual(end(self.processes["xbot_bridge"], signal.SIGINT)[0], 0)
        master.kill()
        master.wait()
        self.start("xbot_bridge", str(self.layer))
        self.move(state="reset")

    @staticmethod
    def master(uri):
        """A master of its own, that answers."""
        process = subprocess.Popen(["rosmaster", "--core", "-p", uri.rpartition(":")[2]], stdout=subprocess.DEVNULL)
        environment = os.environ | {"ROS_MASTER_URI": uri}
        wait_for(lambda: subprocess.run(["rosnode", "list"], env=environment, capture_output=True,
                                        check=False).returncode == 0, START, "a master")
        return process

    @staticmethod
    def offered(uri):
        """Whether a master knows a service of the layer."""
        listed = subprocess.run(["rosservice", "list"], env=os.environ | {"ROS_MASTER_URI": uri}, capture_output=True,
                                text=True, check=False)
        return "/joint_states/trajectory" in listed.stdout.split()


if __name__ == "__main__":
    rostest.rosrun("solfer", "xbot", XbotTest)
