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

import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool
from system import SERVICE, START, ask, end, insist, move, soak, wait_for

from solfer.errors import MiddlewareError
from solfer.middleware.ros.node.launch import free_port
from solfer.middleware.shared_memory import Namespace
from solfer.msg import LayerStatistics
from solfer.telemetry.statistics import LoopCount, RuntimeStatistics

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
        cls.processes, cls.published = {}, JointState()
        rospy.Subscriber("/joint_states", JointState, lambda message: setattr(cls, "published", message), queue_size=1)
        cls.start("xbot_simulator")
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
                stdout=log,
                stderr=subprocess.STDOUT,
                env=os.environ | environment,
            )
        return cls.processes[node]

    def printed(self, node):
        """Return the output of a node."""
        return (self.folder / f"{node}.log").read_text()

    def kill(self, node):
        """End a process as nothing else does."""
        self.processes[node].kill()
        self.processes[node].wait()

    def move(self, **request):
        """Call `joint_states` of the layer until it accepts the request; returns the reply."""
        try:
            return insist(**request)
        except AssertionError as error:
            raise AssertionError(f"{error}\n{self.printed('xbot')}") from None

    def reach(self, field, joint, value, tolerance, **request):
        """Request a motion, and wait until a joint has got there by the bridge's messages."""
        move(
            lambda timeout: wait_for(
                lambda: abs(self.of(field, joint) - value) < tolerance,
                timeout,
                lambda: f"{joint} at {value:g}, not at {self.of(field, joint):g}",
            ),
            self.move,
            **request,
        )

    def of(self, field, joint):
        """Return the newest value of a joint that came through the bridge."""
        published = self.published
        return dict(zip(published.name, getattr(published, field), strict=True)).get(joint, float("nan"))

    def cycles(self):
        """Cycles that the layer has made; 0 while there is none."""
        try:
            return RuntimeStatistics.attach(self.namespace.folder).counts[LoopCount.CYCLES]
        except MiddlewareError:
            return 0

    def turn(self, speed):
        """Turn the wheels, and wait until they do."""
        self.reach("velocity", WHEELS[0], speed, 0.1, joints=WHEELS, velocities=[speed] * 4)

    def test_requests_go_in_and_measurements_come_out(self):
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

    def test_the_plugin_is_switched_by_xbotcores_services(self):
        self.move(state="reset")
        switch = rospy.ServiceProxy("/xbotcore/joint_states_switch", SetBool)
        self.assertTrue(switch(False).success)
        wait_for(lambda: not ask(state="reset").success, START, "a plugin that is stopped")
        replies = []

        def starts():
            replies.append(switch(True))  # a reply may be late: then the next one shows that it runs
            return replies[-1].success or "cannot be started: RUNNING" in replies[-1].message

        wait_for(starts, START, lambda: f"a plugin that starts: {replies[-1].message}")
        self.move(state="reset")

    def test_statistics_and_health_are_published(self):
        """Operators see the layer by these alone: its process, rate, ordered stages and their quantiles."""
        self.move(state="reset")
        received, health = [], {}
        rospy.Subscriber("/xbotcore/statistics", LayerStatistics, received.append, queue_size=10)
        rospy.Subscriber(
            "/diagnostics",
            DiagnosticArray,
            lambda message: health.update({status.name: status for status in message.status}),
            queue_size=100,
        )
        wait_for(lambda: len(received) >= 2 and received[-1].plugins[0].stage == "RUNNING", START, "statistics")
        before, now = list(received)[-2:]
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
        wait_for(
            lambda: all(name in health for name in names) and health[names[1]].message.startswith("RUNNING"),
            START,
            lambda: f"health of a plugin that runs: {health}",
        )
        loop, plugin = ({pair.key: pair.value for pair in health[name].values} for name in names)
        self.assertEqual(loop["rate [Hz]"], "500")
        self.assertIn("timer slack 1 ns", loop["scheduling"])
        self.assertTrue({"skipped periods", "overruns", "lateness p99 [us]"} <= set(loop))
        self.assertTrue({"starts", "over budget", *(f"{name} p99 [us]" for name in stages)} <= set(plugin))

    @soak
    def test_the_layer_is_killed_and_comes_back(self):
        """Its wheels stand still, the bridge reports its end, and the next one takes requests."""
        self.turn(1.0)
        received, health = [], []
        rospy.Subscriber("/xbotcore/statistics", LayerStatistics, received.append, queue_size=10)
        rospy.Subscriber("/diagnostics", DiagnosticArray, health.append, queue_size=100)
        wait_for(lambda: received and received[-1].alive, START, "statistics of a layer that lives")
        pid = self.processes["xbot"].pid
        self.kill("xbot")
        wait_for(lambda: abs(self.of("velocity", WHEELS[0])) < 0.1, START, "wheels that stand still")
        wait_for(lambda: not received[-1].alive, START, "statistics of a layer that has ended")
        wait_for(
            lambda: any(
                status.level == 2 and f"process {pid} has ended" in status.message
                for message in list(health)
                for status in message.status
            ),
            START,
            "its health",
        )
        self.start("xbot", str(self.layer))
        wait_for(lambda: received[-1].alive and received[-1].process != pid, START, "statistics of the next layer")
        self.turn(-1.0)
        self.turn(0.0)

    @soak
    def test_a_master_that_starts_anew_ends_bridges(self):
        """A restarted master has forgotten the bridge, which must end with an error so that roslaunch restarts it.

        The layer's cycles go on meanwhile.
        """
        uri = f"http://localhost:{free_port()}"
        master = self.master(uri)
        self.kill("xbot_bridge")
        self.start("xbot_bridge", str(self.layer), ROS_MASTER_URI=uri)
        wait_for(lambda: SERVICE in self.known(uri), START, "the layer's services")
        before = self.cycles()
        master.kill()
        master.wait()
        master = self.master(uri)
        self.assertEqual(self.processes["xbot_bridge"].wait(START), 2)
        self.assertIn("error: node /xbot_bridge ends: ", self.printed("xbot_bridge"))
        self.assertGreater(self.cycles(), before)
        self.start("xbot_bridge", str(self.layer), ROS_MASTER_URI=uri)  # as launch/xbot.launch does
        wait_for(lambda: SERVICE in self.known(uri), START, "the layer's services on the new master")
        self.assertEqual(end(self.processes["xbot_bridge"], signal.SIGINT)[0], 0)
        master.kill()
        master.wait()
        self.start("xbot_bridge", str(self.layer))
        self.move(state="reset")

    @soak
    def test_a_bridge_that_loses_its_namespace_ends(self):
        """Its shared memory is removed: a bridge to nothing must not stay alive and look healthy."""
        uri = f"http://localhost:{free_port()}"
        master, namespace = self.master(uri), Namespace(f"{self.name}-lost")
        bridge = subprocess.Popen(
            [sys.executable, str(REPOSITORY / "nodes" / "xbot_bridge"), str(self.layer), "--namespace", namespace.name],
            env=os.environ | {"ROS_MASTER_URI": uri},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            wait_for(lambda: "/diagnostics" in self.known(uri), START, "a bridge")
            shutil.rmtree(namespace.folder)
            published, _ = bridge.communicate(timeout=START)
        finally:
            bridge.kill()
            master.kill()
            master.wait()
            shutil.rmtree(namespace.folder, ignore_errors=True)
        self.assertEqual(bridge.returncode, 2, published)
        self.assertIn("error: no other process finds this one any more", published)

    @staticmethod
    def master(uri):
        """Run a master of its own, that answers."""
        process = subprocess.Popen(["rosmaster", "--core", "-p", uri.rpartition(":")[2]], stdout=subprocess.DEVNULL)
        wait_for(rosgraph.Master(rospy.get_name(), uri).is_online, START, "a master")
        return process

    @staticmethod
    def known(uri):
        """Return the names of the topics that are published, and of the services, at a master."""
        topics, _, services = rosgraph.Master(rospy.get_name(), uri).getSystemState()
        return {name for name, _ in topics + services}


if __name__ == "__main__":
    rostest.rosrun("solfer", "xbot", XbotTest)
