#!/usr/bin/env python3
"""A real-time layer seen from ROS through its bridge, while one process after the other is killed."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool
from system import START, ask, end, insist, move, wait_for

from solfer.errors import MiddlewareError
from solfer.middleware.ros.launch import free_port
from solfer.middleware.xbot import Namespace
from solfer.middleware.xbot.board import Board
from solfer.msg import LayerStatistics

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
        """Ask `joint_states` of the layer until it does what is asked; the reply."""
        try:
            return insist(**request)
        except AssertionError as error:
            raise AssertionError(f"{error}\n{self.printed('xbot')}") from None

    def reach(self, field, joint, value, tolerance, **request):
        """Ask for a motion, and wait until the bridge tells that a joint has got there."""
        move(lambda timeout: wait_for(lambda: abs(self.of(field, joint) - value) < tolerance, timeout,
                                      lambda: f"{joint} at {value:g}, not at {self.of(field, joint):g}"),
             self.move, **request)

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
        self.reach("velocity", WHEELS[0], speed, 0.1, joints=WHEELS, velocities=[speed] * 4)

    def test_requests_go_in_and_what_is_measured_comes_out(self):
        self.reach("position", "torso_yaw", 0.3, 0.02, joints=["torso_yaw"], positions=[0.3], speed=1.0)
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
        replies = []

        def starts():
            replies.append(switch(True))  # a reply may be late: then the next one says that it runs
            return replies[-1].success or "cannot be started: RUNNING" in replies[-1].message

        wait_for(starts, START, lambda: f"a plugin that starts: {replies[-1].message}")
        self.move(state="reset")

    def test_statistics_and_health_of_the_layer_are_told(self):
        self.move(state="reset")
        heard, health = [], {}
        rospy.Subscriber("/xbotcore/statistics", LayerStatistics, heard.append, queue_size=10)
        rospy.Subscriber("/diagnostics", DiagnosticArray, lambda message: health.update(
            {status.name: status for status in message.status}), queue_size=100)
        wait_for(lambda: len(heard) >= 2 and heard[-1].plugins[0].stage == "RUNNING", START, "statistics")
        before, now = list(heard)[-2:]
        self.assertEqual((now.process, now.alive, now.rate), (self.processes["xbot"].pid, True, 500.0))
        self.assertGreater(now.cycles, before.cycles)
        self.assertIn("timer slack 1 ns", now.scheduling)
        self.assertEqual([stage.name for stage in now.loop], ["cycle", "overhead", "lateness"])
        (plugin,) = now.plugins
        stages = {stage.name: stage for stage in plugin.stages}
        self.assertEqual(plugin.name, "joint_states")
        self.assertEqual(list(stages), ["calls", "read", "robot", "component", "gate", "write"])
        for stage in (*now.loop, stages["read"], stages["component"], stages["write"]):
            self.assertGreater(stage.count, 0, stage.name)
            self.assertLessEqual(0.0, stage.median)
            self.assertLessEqual(stage.median, stage.p99)
            self.assertLessEqual(stage.p99, stage.longest)
            self.assertLess(stage.longest, 60.0)
        names = ("xbot_bridge: xbotcore", "xbot_bridge: joint_states")
        wait_for(lambda: all(name in health for name in names) and health[names[1]].message == "RUNNING", START,
                 lambda: f"health of a plugin that runs: {health}")
        loop, plugin = ({pair.key: pair.value for pair in health[name].values} for name in names)
        self.assertEqual(loop["rate [Hz]"], "500")
        self.assertIn("timer slack 1 ns", loop["scheduling"])
        self.assertTrue({"skipped periods", "overruns", "lateness p99 [us]"} <= set(loop))
        self.assertTrue({"starts", "over budget", *(f"{name} p99 [us]" for name in stages)} <= set(plugin))

    def test_a_layer_that_is_killed_is_said_to_have_ended(self):
        self.move(state="reset")
        heard, health = [], []
        rospy.Subscriber("/xbotcore/statistics", LayerStatistics, heard.append, queue_size=10)
        rospy.Subscriber("/diagnostics", DiagnosticArray, health.append, queue_size=100)
        wait_for(lambda: heard and heard[-1].alive, START, "statistics of a layer that lives")
        pid = self.processes["xbot"].pid
        self.kill("xbot")
        wait_for(lambda: not heard[-1].alive, START, "statistics of a layer that has ended")
        wait_for(lambda: any(status.level == 2 and f"process {pid} has ended" in status.message
                             for message in list(health) for status in message.status), START, "its health")
        self.start("xbot", str(self.layer))
        wait_for(lambda: heard[-1].alive and heard[-1].process != pid, START, "statistics of the next layer")
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
        self.assertEqual(self.processes["xbot_bridge"].wait(START), 2)
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
