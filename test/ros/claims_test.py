#!/usr/bin/env python3
"""Plugins that claim the same joints, in two nodes and in one; one that is killed; and wrong commands."""

import os
import signal
import sys
import tempfile
import time
import unittest
from collections.abc import Callable
from pathlib import Path

import numpy as np
import rosnode
import rospy
import rostest
from std_srvs.srv import SetBool
from system import START, Robot, end, program, run, soak, started, wait_for, wait_for_plugin

from solfer.msg import JointCommand
from solfer.srv import ListControllers, MoveJoints

HERE = Path(os.path.realpath(__file__)).parent
sys.path.insert(0, str(HERE.parent))

from support.plugins.components import parts  # noqa: E402
from support.ros.switched_node import SwitchedNode, left_at_master  # noqa: E402

CONFIGURATION = HERE.parents[1] / "config/centauro.yaml"
PLUGIN = program("plugin", "-p", "joint_states", "-c", str(CONFIGURATION))
RATE = 100.0  # [Hz]
SWITCHES = 30
WHEELS = ["j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4"]


class ClaimsTest(unittest.TestCase):
    """Each test starts plugins of its own on the same simulated robot."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Robot()
        cls.list = rospy.ServiceProxy("/lower_level/list_controllers", ListControllers, persistent=True)
        cls.publisher = rospy.Publisher("/position_controller/command", JointCommand, queue_size=10, tcp_nodelay=True)
        cls.wheels = rospy.Publisher("/velocity_controller/command", JointCommand, queue_size=10, tcp_nodelay=True)
        wait_for(lambda: cls.wheels.get_num_connections() > 0, START, "a simulator that receives speeds")
        wait_for(lambda: cls.publisher.get_num_connections() > 0, START, "a simulator that receives commands")

    def owners(self) -> dict[str, str]:
        """Who commands each controller."""
        published = self.list()
        return dict(zip(published.names, published.claimed_by, strict=True))

    def base_moves(self, duration: float) -> float:
        """Largest distance of the base from where it was during `duration` [s, m]."""
        self.robot.odometry.clear()
        self.robot.passes(duration)
        track = [message.pose.pose.position for message in list(self.robot.odometry)]
        points = np.array([(point.x, point.y, point.z) for point in track])
        self.assertGreater(len(points), 20)
        return float(np.abs(points - points[0]).max())

    def publish(self, duration: float, names: list[str], **fields: list[float]) -> None:
        """Send a command again and again for `duration` [s]."""
        message = JointCommand(name=names, **fields)
        for _ in range(round(duration * RATE)):
            self.publisher.publish(message)
            time.sleep(1.0 / RATE)

    @soak
    def test_a_killed_plugin_leaves_free_resting_joints(self):
        with started(*PLUGIN) as process:
            wait_for_plugin(process)
            self.robot.turn_wheels(1.0)
            self.assertIn("/joint_states: ", self.owners()["velocity_controller"])
            before = self.robot.positions()
            process.send_signal(signal.SIGKILL)
            wait_for(lambda: not any(self.owners().values()), START, "joints that are free")
        wait_for(lambda: max(map(abs, self.robot.speeds())) < 0.02, START, "wheels at rest")
        self.robot.settle()
        self.assertLess(self.base_moves(2.0), 0.001)
        self.assertLess(self.robot.moved(before), 0.02)

    def goes_on_beside(self, act: Callable[[], None]) -> None:
        """Check that the wheels turn on; once more where a machine that starts a node stalled the plugin of another."""
        for left in (2, 1, 0):
            self.robot.turn_wheels(1.0)
            act()
            if max(abs(speed - 1.0) for speed in self.robot.speeds()) < 0.1:
                return
            self.assertTrue(left, self.robot.speeds())

    def check_refusals(self) -> None:
        """Start a second plugin: it is refused for its joints, its node or its service, with the owner's name."""
        joints = ("error: plugin 'joint_lower'", "'/joint_lower' cannot", "'/joint_states'", "hip_yaw_1")
        for arguments, texts in (
            (("-n", "joint_lower"), joints),
            ((), ("/joint_states is running already",)),
            (("__name:=other",), ("/joint_states/trajectory is offered by another node",)),
        ):
            code, output = run(*PLUGIN, *arguments)
            self.assertEqual(code, 2, output)
            for text in texts:
                self.assertIn(text, output)
            self.assertNotIn("Traceback", output)

    def check_a_publisher(self) -> None:
        """Publish commands of joints that are taken: nothing moves."""
        self.robot.turn_wheels(0.0)
        self.robot.settle()
        before = self.robot.positions()
        self.publish(0.5, ["torso_yaw"], position=[0.5])
        self.assertLess(self.robot.moved(before), 0.003)
        self.assertNotIn(rospy.get_name(), self.owners()["position_controller"])

    def test_others_are_refused_where_joints_are_taken(self):
        """A second plugin, and a publisher, beside a plugin that goes on; `rosnode kill` ends it at rest."""
        with started(*PLUGIN) as process:
            wait_for_plugin(process)
            self.goes_on_beside(self.check_refusals)
            self.assertIsNone(process.poll())
            wait_for_plugin(process)
            self.check_a_publisher()
            self.robot.turn_wheels(1.0)
            code, output = run("rosnode", "kill", "/joint_states")
            self.assertEqual(code, 0, output)
            self.assertEqual(process.wait(START), 0)
        self.assertNotIn("/joint_states", rosnode.get_node_names())
        wait_for(lambda: not any(self.owners().values()), START, "joints that were given back")
        wait_for(lambda: max(map(abs, self.robot.speeds())) < 0.02, START, "wheels at rest")
        self.assertEqual(set(self.robot.wheel_command.velocity), {0.0})

    @soak
    def test_components_of_a_node_own_joints(self):
        """ROS has one name per node, claims have one per component: a stranger's command in its name changes no owner.

        Joints that a component gives back stay free until it is switched on again.
        """
        with tempfile.TemporaryDirectory() as folder:
            names = ("springs", "drives", "all_of_it")
            with started(sys.executable, str(HERE / "several.py"), str(parts(Path(folder))), *names) as node:
                own = {"position_controller": "/limbs#springs: position, effort"}
                driven = {"velocity_controller": "/limbs#drives: velocity"}
                wait_for(lambda: self.owners() == own | driven, START, lambda: f"two owners: {self.owners()}")
                rospy.wait_for_service("/drives/trajectory", START)
                move = rospy.ServiceProxy("/drives/trajectory", MoveJoints)
                wait_for(lambda: move(joints=WHEELS, velocities=[1.0] * 4).success, START, "wheels that are driven")
                switch = rospy.ServiceProxy("/springs/switch", SetBool)
                self.assertTrue(switch(False).success)
                wait_for(lambda: not self.owners()["position_controller"], START, "joints that were given back")
                message = JointCommand(name=WHEELS, velocity=[-1.0] * 4, component="drives")
                for _ in range(50):  # as long as a lease, and more
                    self.wheels.publish(message)
                    self.robot.passes(0.01)
                self.assertEqual(self.owners(), {"position_controller": ""} | driven)
                self.assertLess(max(abs(speed - 1.0) for speed in self.robot.speeds()), 0.1)
                self.assertTrue(switch(True).success)
                wait_for(lambda: self.owners() == own | driven, START, "a component that is back")
                code, output = end(node, signal.SIGTERM)
        self.assertEqual(code, 0, output)
        for text in ("error: plugin 'all_of_it' does not get", "'/limbs#all_of_it' cannot", "'/limbs#"):
            self.assertIn(text, output)

    @soak
    def test_switched_components_leave_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            names = ("springs", "drives")
            with started(sys.executable, str(HERE / "several.py"), str(parts(Path(folder))), *names) as process:
                node = SwitchedNode(names, names)
                node.switch_at_random(4)
                first = node.held()
                node.switch_at_random(SWITCHES)
                self.assertEqual(node.held(), first)
                code, output = end(process, signal.SIGTERM)
        self.assertEqual((code, left_at_master()), (0, []), output)
        self.assertFalse(any(self.owners().values()))

    @soak
    def test_wrong_commands_move_nothing(self):
        self.robot.settle()
        before = self.robot.positions()
        for names, positions in (
            (["torso_yaw", "neck_yaw"], [0.5, float("nan")]),
            (["torso_yaw", "torso_jaw"], [0.5, 0.5]),
            (["torso_yaw", "torso_yaw"], [0.5, 0.5]),
            (["torso_yaw"], [0.5, 0.5]),
            (["torso_yaw"], [100.0]),
        ):
            self.publish(0.2, names, position=positions)
        self.assertLess(self.robot.moved(before), 0.003)
        self.assertFalse(any(self.owners().values()))


if __name__ == "__main__":
    rostest.rosrun("solfer", "claims", ClaimsTest)
