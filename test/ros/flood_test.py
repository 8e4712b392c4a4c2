#!/usr/bin/env python3
"""Floods of another node: the plugin that commands keeps its joints, and no cycle receives more than its ration."""

import contextlib
import functools
import threading
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger
from system import START, Robot, insist, move, soak, wait_for, wait_for_plugin

from solfer.lower_level.records import RationRecord
from solfer.middleware.ros.codecs.packed_message import MESSAGE_LENGTH
from solfer.msg import JointCommand
from solfer.srv import ClaimJoints, ClaimJointsRequest, ListControllers

NAMES = 200_000
RATION = RationRecord()


class Large(JointCommand):
    """A command with many names, packed once."""

    BYTES = bytes(16) + MESSAGE_LENGTH.pack(NAMES) + NAMES * (MESSAGE_LENGTH.pack(1) + b"x") + bytes(20)

    def serialize(self, buffer):
        buffer.write(self.BYTES)


class FloodTest(unittest.TestCase):
    """The tests run in this order, on one robot."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot, cls.reports = Robot(), []
        wait_for_plugin()
        cls.publishers = {}
        for kind in (JointCommand, Large):
            cls.publishers[kind] = rospy.Publisher("/velocity_controller/command", kind, queue_size=10)
        for publisher in cls.publishers.values():
            wait_for(lambda one=publisher: one.get_num_connections() > 0, START, "a simulator that receives commands")
        rospy.Subscriber("/diagnostics", DiagnosticArray, cls.receive)

    @classmethod
    def receive(cls, message):
        for status in message.status:
            if status.name.endswith(": lower_level"):
                cls.reports.append({pair.key: pair.value for pair in status.values})

    def dropped(self) -> int:
        """Commands that the lower level has dropped so far."""
        return int(float(self.reports[-1]["commands dropped"]))

    def keeps_its_joints(self, *, dropped):
        """Wait for what has been dropped; meanwhile the plugin has had its joints, and a cycle its ration."""
        first = len(self.reports)
        wait_for(
            lambda: self.dropped() >= dropped and len(self.reports) > first + 1,
            START,
            lambda: f"{dropped} commands that are dropped: {self.reports[-1]}",
        )
        for report in self.reports[first:]:
            self.assertIn("/joint_states: velocity", report["velocity_controller"])
            self.assertNotIn("refused of /joint_states", report)
            self.assertLessEqual(float(report["commands of a cycle, at most"]), RATION.owners + RATION.others)
            self.assertLessEqual(float(report["requests of a cycle, at most"]), RATION.requests)

    @soak
    def test_commands_that_are_too_large(self):
        wait_for(lambda: bool(self.reports), START, "a report of the lower level")
        before = self.dropped()

        def floods():
            self.publishers[Large].publish(Large())  # what a full queue of the publisher loses never leaves it
            rospy.rostime.wallsleep(0.02)
            return self.dropped() >= before + 20

        wait_for(floods, START, lambda: f"20 commands that are dropped: {self.reports[-1]}")
        self.keeps_its_joints(dropped=20)

    def test_commands_that_are_wrong_in_a_flood(self):
        command, before = JointCommand(name=["no_such_joint"], velocity=[1.0]), len(self.reports)
        insist(joints=["torso_yaw"], positions=[0.2], speed=0.3)
        while len(self.reports) < before + 3:
            self.publishers[JointCommand].publish(command)
        self.keeps_its_joints(dropped=20)
        goal = {"torso_yaw": 0.2}  # requested again if the machine stalled so long that the plugin gave it up
        move(functools.partial(self.robot.arrive, goal), joints=list(goal), positions=list(goal.values()), speed=0.3)

    @soak
    def test_requests_and_an_emergency_stop_among_them(self):
        """Eight threads flood the claims: the stop still gets through, and the plugin claims again after its reset."""
        ending, answers = threading.Event(), []

        def claim():
            proxy = rospy.ServiceProxy("/lower_level/claim", ClaimJoints, persistent=True)
            while not ending.is_set():
                with contextlib.suppress(rospy.ServiceException):
                    answers.append(proxy(owner="/x", controllers=["velocity_controler"]).message)

        threads = [threading.Thread(target=claim, daemon=True) for _ in range(8)]
        for thread in threads:
            thread.start()
        wait_for(lambda: len(answers) > 200, START, "claims that are answered")
        self.keeps_its_joints(dropped=20)
        large = rospy.ServiceProxy("/lower_level/claim", ClaimJoints)(ClaimJointsRequest(owner=10**7 * "x"))
        self.assertFalse(large.success)
        self.assertRegex(large.message, r"a request of 100000\d\d bytes \(expected: ")
        self.assertTrue(rospy.ServiceProxy("/lower_level/emergency_stop", Trigger)().success)
        ending.set()
        for thread in threads:
            thread.join(START)
        self.assertTrue(any("velocity_controller" in answer for answer in answers))
        self.assertTrue(rospy.ServiceProxy("/lower_level/reset_emergency_stop", Trigger)().success)
        wait_for(
            lambda: "/joint_states"
            in "".join(rospy.ServiceProxy("/lower_level/list_controllers", ListControllers)().claimed_by),
            START,
            "a plugin that claims anew",
        )


if __name__ == "__main__":
    rostest.rosrun("solfer", "flood", FloodTest)
