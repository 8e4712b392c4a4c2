#!/usr/bin/env python3
"""A plugin that the lower level refuses waits, reports the reason, and goes on without a new start."""

import itertools
import os
import re
import signal
import unittest
from pathlib import Path

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger
from system import START, Robot, ask, end, program, soak, started, wait_for, wait_for_plugin

from solfer.srv import ListControllers, SwitchControllers

CONFIGURATION = Path(os.path.realpath(__file__)).parents[2] / "config/centauro.yaml"
PLUGIN = program("plugin", "-p", "joint_states", "-c", str(CONFIGURATION))
GOOD, ERROR = 0, 2


@soak
class RefusedTest(unittest.TestCase):
    """One plugin on a simulated robot."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot, cls.health = Robot(), (GOOD, "")
        rospy.Subscriber("/diagnostics", DiagnosticArray, cls.receive_health, queue_size=100)

    @classmethod
    def receive_health(cls, message: DiagnosticArray) -> None:
        """Keep the newest health report of the plugin."""
        for status in message.status:
            if status.name == "joint_states: joint_states":
                cls.health = status.level, status.message

    def is_refused(self, reason: str) -> None:
        """Check that the plugin reports that it waits because of `reason`, and refuses requests with it."""
        wait_for(lambda: self.health[0] == ERROR and reason in self.health[1], START, f"a health report of {reason}")
        reply = ask(state="reset")
        self.assertFalse(reply.success)
        self.assertIn(reason, reply.message)

    def creeps(self) -> bool:
        """Whether the joints move slower than 0.1 rad/s: dampers let some of them sink on for minutes."""
        before = self.robot.positions()
        self.robot.passes(0.3)
        return self.robot.moved(before) < 0.03

    def goes_on(self, before: dict[str, float]) -> None:
        """Check that the plugin accepts requests again, nothing has jumped, and the wheels turn."""
        wait_for_plugin()
        wait_for(lambda: self.health[0] == GOOD, START, "a good health report")
        self.robot.settle(START)
        self.assertLess(self.robot.moved(before), 0.08)
        self.robot.turn_wheels(1.0)
        self.robot.turn_wheels(0.0)

    def test_it_waits_and_goes_on(self):
        with started(*PLUGIN) as process:
            wait_for_plugin(process)
            self.stop_and_start_a_controller()
            self.stop_and_reset()
            code, output = end(process, signal.SIGTERM)
        self.assertEqual(code, 0, output)
        # on a busy machine it may wait for something else in between, and then report this once more
        reports = re.findall(r"joint_states holds and waits for (.*)", output)
        self.assertTrue(any(report.startswith("its joints: emergency stop") for report in reports), output)
        self.assertFalse(any(report == after for report, after in itertools.pairwise(reports)), output)

    def stop_and_reset(self) -> None:
        """Check an emergency stop, and its reset."""
        self.robot.turn_wheels(1.0)
        self.assertTrue(rospy.ServiceProxy("/lower_level/emergency_stop", Trigger)().success)
        self.is_refused("emergency stop")
        wait_for(self.creeps, START, "a robot that has sunk to the ground")
        before = self.robot.positions()
        self.assertTrue(rospy.ServiceProxy("/lower_level/reset_emergency_stop", Trigger)().success)
        self.goes_on(before)

    def stop_and_start_a_controller(self) -> None:
        """Check a controller that is stopped, and started again."""
        switch = rospy.ServiceProxy("/lower_level/switch", SwitchControllers)
        before = self.robot.positions()
        self.assertTrue(switch(stop=["position_controller"]).success)
        self.is_refused("controller 'position_controller' is stopped")
        controllers = rospy.ServiceProxy("/lower_level/list_controllers", ListControllers)
        wait_for(lambda: not any(controllers().claimed_by), START, "joints that are free")
        self.assertTrue(switch(start=["position_controller"]).success)
        self.goes_on(before)


if __name__ == "__main__":
    rostest.rosrun("solfer", "refused", RefusedTest)
