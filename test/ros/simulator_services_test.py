#!/usr/bin/env python3
"""The simulator's services on a real master, while a plugin, robot_state_publisher and rosbag listen."""

import os
import signal
import tempfile
import time
import unittest
from pathlib import Path

import rosnode
import rospy
import rostest
from std_srvs.srv import SetBool
from system import START, Robot, end, insist, soak, started, subscribers, wait_for, wait_for_plugin

from solfer.srv import PushLink, ResetSimulation, Screenshot, SetDrive, SetFriction, StepSimulation

LISTENERS = ("/simulator", "/joint_states", "/robot_state_publisher")


def service(name: str, kind: type, **request: object) -> object:
    """Return the reply of a service of the simulator."""
    rospy.wait_for_service(f"/simulator/{name}", START)
    return rospy.ServiceProxy(f"/simulator/{name}", kind)(**request)


class SimulatorServicesTest(unittest.TestCase):
    """What a real robot does not offer."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Robot()
        wait_for_plugin()

    def tearDown(self):
        for name in LISTENERS:
            wait_for(lambda name=name: rosnode.rosnode_ping(name, max_count=1), START, f"an answer of {name}")

    def test_a_reset_lets_no_node_fail(self):
        """The robot jumps by a metre, yet stamps rise on, rosbag ends cleanly, and the plugin runs again."""
        with tempfile.TemporaryDirectory() as folder:
            bag = Path(folder, "reset.bag")
            with started("rosbag", "record", "-O", str(bag), "/tf", "/joint_states", "/floating_base") as process:
                wait_for(
                    lambda: any(node.startswith("/record") for node in subscribers("/floating_base")), START, "rosbag"
                )
                del self.robot.odometry[:]
                reply = service("reset", ResetSimulation, state="mammal_wide_high", x=1.0, height=0.05)
                self.assertTrue(reply.success, reply.message)
                wait_for(self.is_there, START, "the robot there")
                self.robot.passes(1.0)
                code, output = end(process, signal.SIGINT)
            self.assertEqual(code, 0, output)
            self.assertGreater(bag.stat().st_size, 10_000)
        stamps = [message.header.stamp for message in list(self.robot.odometry)]
        self.assertEqual(stamps, sorted(stamps))
        wait_for_plugin()

    def is_there(self) -> bool:
        """Whether the robot is where the reset puts it."""
        odometry = list(self.robot.odometry)
        return bool(odometry) and abs(odometry[-1].pose.pose.position.x - 1.0) < 0.05

    def test_after_a_pause_the_plugin_goes_on(self):
        insist(joints=["torso_yaw"], positions=[0.3], speed=0.3)
        self.assertTrue(service("pause", SetBool, data=True).success)
        time.sleep(0.1)
        before = self.robot.positions()
        reply = service("step", StepSimulation, count=5)
        self.assertTrue(reply.success, reply.message)
        time.sleep(1.0)  # longer than any timeout of a feedback
        self.assertLess(self.robot.moved(before), 0.01)
        self.assertTrue(service("pause", SetBool, data=False).success)
        self.robot.arrive({"torso_yaw": 0.3}, START)

    def test_a_push_friction_and_a_drive(self):
        self.assertTrue(service("push", PushLink, link="torso_2", force=[0.0, 100.0, 0.0], duration=0.2).success)
        self.assertTrue(service("set_friction", SetFriction, surface="ground", coefficient=0.9).success)
        self.assertTrue(service("set_drive", SetDrive, joint="torso_yaw", state="sound").success)

    @soak
    def test_a_screenshot(self):
        """It is a PNG in a private folder of mode 0700, and a path elsewhere writes nothing."""
        replies = []

        def drawn() -> bool:  # its process has to start first, on a busy machine
            replies.append(service("screenshot", Screenshot, path="robot.png"))
            return replies[-1].success

        wait_for(drawn, START, lambda: f"a picture: {replies[-1].message}")
        path = Path(replies[-1].message)
        self.assertEqual(path.parent.stat().st_mode & 0o777, 0o700)
        self.assertEqual(path.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        path.unlink()
        with tempfile.TemporaryDirectory() as folder:
            reply = service("screenshot", Screenshot, path=f"{folder}/robot.png")
            self.assertFalse(reply.success)
            self.assertEqual(os.listdir(folder), [])

    def test_wrong_requests(self):
        for reply, error in (
            (service("push", PushLink, link="torso_3", duration=1.0), "torso_2"),
            (service("push", PushLink, link="torso_2", duration=float("nan")), "duration"),
            (service("reset", ResetSimulation, state="mammal_wide_hig"), "mammal_wide_high"),
            (service("step", StepSimulation, count=1), "not paused"),
            (service("set_friction", SetFriction, surface="grund", coefficient=1.0), "ground"),
        ):
            self.assertFalse(reply.success)
            self.assertIn(error, reply.message)


if __name__ == "__main__":
    rostest.rosrun("solfer", "simulator_services", SimulatorServicesTest)
