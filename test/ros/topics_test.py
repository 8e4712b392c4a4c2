#!/usr/bin/env python3
"""Plugins report a wrong topic: one without a subscriber or publisher, its place, and the nearest names."""

import os
import tempfile
import threading
import unittest
from pathlib import Path

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import String
from system import START, Robot, insist, program, soak, started, wait_for

CONFIGURATION = Path(os.path.realpath(__file__)).parents[2] / "config/centauro.yaml"
SHIPPED = CONFIGURATION.read_text().replace("{file: ", f"{{file: {CONFIGURATION.parent}/")
LINK_SIDE = "source: joint_states              # topic"
WHEELS = "velocity_controller:\n        sink: /command"


class TopicsTest(unittest.TestCase):
    """Each test starts a plugin with one word of its configuration changed."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot, cls.health = Robot(), {}
        rospy.Subscriber("/diagnostics", DiagnosticArray, cls.receive, queue_size=100)

    @classmethod
    def receive(cls, message):
        """Health by the name of the part."""
        cls.health |= {status.name: status for status in message.status}

    def reports(self, old, new, start, ending, act=lambda process: None):
        """Check that a plugin of a changed file prints one line with a place in it; the plugin is ended."""
        text, lines = SHIPPED.replace(old, new), []
        self.assertNotEqual(text, SHIPPED)
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            file.write(text)
            file.flush()
            place = f"{file.name}:{text[: text.index(new) + len(new)].count(chr(10)) + 1}:"
            with started(*program("plugin", "-p", "joint_states", "-c", file.name)) as process:
                reader = threading.Thread(target=lambda: lines.extend(iter(process.stdout.readline, "")))
                reader.start()
                wait_for(lambda: [line for line in list(lines) if start in line], START, lambda: f"{start}: {lines}")
                act(process)
                process.terminate()
                reader.join()
                process.wait(START)
        (line,) = [line for line in lines if start in line]
        self.assertIn(place, line)
        self.assertIn(ending, line)
        self.assertFalse([line for line in lines if "Traceback" in line])

    def test_a_command_without_a_subscriber(self):
        """The misspelt topic turns no wheel, although requests succeed: only the health can explain it."""

        def drive(process):
            insist(process, joints=self.robot.wheels, velocities=[1.0] * len(self.robot.wheels))
            self.robot.passes(1.0)
            self.assertLess(max(map(abs, self.robot.speeds())), 0.05)
            health, text = "joint_states: joint_states", "no subscriber on /velocity_controller/comand"
            wait_for(lambda: health in self.health and text in self.health[health].message, START, "that in its health")
            self.assertEqual(self.health[health].level, 1)

        self.reports(
            WHEELS,
            WHEELS.replace("command", "comand"),
            "no subscriber on /velocity_controller/comand",
            "did you mean /velocity_controller/command",
            drive,
        )

    @soak
    def test_a_state_without_a_publisher(self):
        self.reports(LINK_SIDE, "source: joint_stats", "no publisher on /joint_stats", "did you mean /joint_states")

    def test_a_topic_of_another_message(self):
        self.reports(
            LINK_SIDE, "source: floating_base", "/floating_base carries nav_msgs/Odometry", "not sensor_msgs/JointState"
        )

    @soak
    def test_a_command_of_a_wrong_type(self):
        subscriber = rospy.Subscriber("/velocity_controller/words", String, lambda message: None)
        try:
            self.reports(
                WHEELS,
                WHEELS.replace("command", "words"),
                "a subscriber of /velocity_controller/words",
                "expects std_msgs/String, not solfer/JointCommand (controller 'velocity_controller'",
            )
        finally:
            subscriber.unregister()


if __name__ == "__main__":
    rostest.rosrun("solfer", "topics", TopicsTest)
