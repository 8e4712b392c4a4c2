#!/usr/bin/env python3
"""A node goes by /clock where /use_sim_time is true: it waits, ages and stamps in simulated time, which may go back."""

import contextlib
import os
import shutil
import subprocess
import sys
import threading
import time
import unittest

import genpy
import numpy as np
import rospy
import rostest
from rosgraph_msgs.msg import Clock
from system import NODES, START, program, run, started, wait_for

from solfer.middleware.ros import RosMiddleware, RosNode
from solfer.middleware.shared_memory import Namespace
from solfer.transport import JointMessage, MessageStatus

FIRST = 5.0
"""Simulated time at which the node starts [s]."""

PUBLISH_CLOCK = ("rostopic", "pub", "--latch", "/clock", "rosgraph_msgs/Clock", f"{{clock: {{secs: {FIRST:.0f}}}}}")

RIVALS = 4
"""Nodes that start in the same moment."""

IMPATIENT = f"""
import runpy, sys
import solfer.middleware.ros.node.clock as clock
wait_for = clock.wait_for
clock.wait_for = lambda condition, timeout, running: wait_for(condition, 0.05 * timeout, running)
sys.argv[0] = {program("plugin")[1]!r}
runpy.run_path(sys.argv[0], run_name="__main__")
"""
"""A plugin that waits for the time for 1 s instead of 20 s."""

RIVAL = """
import sys
from solfer.middleware.ros import RosNode, run_main

def main(argv):
    print("has imported what it needs", flush=True)
    input()
    with RosNode("rival", argv, publishes_time=True):
        print("publishes", flush=True)
        input()
    return 0

run_main(main)
"""


def rivals() -> list[str]:
    """Start nodes that simulate, all in the same moment; return what each of them says."""
    command, pipe = (sys.executable, "-c", RIVAL), subprocess.PIPE
    with contextlib.ExitStack() as stack:
        processes = [
            stack.enter_context(
                subprocess.Popen(
                    (*command, f"__name:=rival_{each}"), stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True
                )
            )
            for each in range(RIVALS)
        ]
        for each in processes:
            stack.callback(each.kill)
        for each in processes:
            each.stdout.readline()
        for each in processes:
            each.stdin.write("\n")
            each.stdin.flush()
        said = [each.stdout.readline() for each in processes]
        for each in processes:
            with contextlib.suppress(BrokenPipeError):
                each.stdin.write("\n")
                each.stdin.close()
        return [first + each.stdout.read() for first, each in zip(said, processes, strict=True)]


class ClockTest(unittest.TestCase):
    """One node; the tests publish the time in turn."""

    @classmethod
    def setUpClass(cls):
        rospy.set_param("/use_sim_time", True)
        cls.addClassCleanup(rospy.set_param, "/use_sim_time", False)
        cls.without_clock = run(sys.executable, "-c", IMPATIENT, "-p", "joint_states")
        cls.rivals = rivals()
        with started(*PUBLISH_CLOCK):
            cls.middleware = RosMiddleware(RosNode("clock_test"))
        cls.publisher = rospy.Publisher("/clock", Clock, queue_size=10, tcp_nodelay=True)
        wait_for(lambda: cls.publisher.get_num_connections() > 0, START, "a connection of /clock")

    def publish(self, simulated: float) -> None:
        """Publish the time [s], and wait until the node knows it."""
        stamp = genpy.Time.from_sec(simulated)
        self.publisher.publish(Clock(stamp))
        wait_for(lambda: rospy.Time.now() == stamp, START, f"time {simulated:g} s")

    def test_without_a_clock_a_node_ends(self):
        code, output = self.without_clock
        self.assertEqual(code, 2, output)
        self.assertIn("use_sim_time is true but nothing publishes /clock", output)
        self.assertNotIn("Traceback", output)

    def test_a_second_publisher_of_the_time_is_refused(self):
        code, output = run(*program("simulator", "__name:=second"))
        self.assertEqual(code, 2, output)
        self.assertIn(f"{rospy.get_name()} publishes /clock already", output)
        self.assertNotIn("Traceback", output)

    def test_the_bridge_of_a_simulated_layer_is_refused_beside_a_simulator(self):
        namespace = Namespace(f"rostest-{os.getpid()}")
        self.addCleanup(shutil.rmtree, namespace.folder, ignore_errors=True)
        layer = str(NODES.parent / "config" / "xbot.yaml")
        code, output = run(*program("xbot_bridge", layer, "--namespace", namespace.name, "__name:=bridge"))
        self.assertEqual(code, 2, output)
        self.assertIn(f"{rospy.get_name()} publishes /clock already", output)
        self.assertIn(f"rosnode kill {rospy.get_name()}, or rosparam set /use_sim_time false", output)

    def test_of_nodes_that_start_together_one_publishes_the_time(self):
        (winner,) = [place for place, text in enumerate(self.rivals) if text == "publishes\n"]
        for text in self.rivals[:winner] + self.rivals[winner + 1 :]:
            self.assertRegex(text, r"^error: /rival_\d publishes /clock already")
            self.assertNotIn("Traceback", text)

    def test_time_passes_as_published_and_never_back(self):
        self.publish(10.0)
        start, rewinds = self.middleware.now(), self.middleware.rewinds
        for published, passed in (
            (10.5, 0.5),
            (10.5, 0.5),
            (12.0, 2.0),
            (0.0, 2.0),
            (0.25, 2.25),
            (0.1, 2.25),
            (0.2, 2.35),
        ):
            self.publish(published)
            self.assertAlmostEqual(self.middleware.now() - start, passed, places=6)
        self.assertEqual(self.middleware.rewinds - rewinds, 2)

    def test_a_loop_sleeps_until_simulated_time_has_come(self):
        self.publish(20.0)
        woken, deadline = [], self.middleware.now() + 1.0
        thread = threading.Thread(target=lambda: (self.middleware.sleep_until(deadline), woken.append(True)))
        thread.start()
        for published in (20.4, 20.9, 0.0, 0.05):  # the time goes back, and 0.95 s have passed
            self.publish(published)
            time.sleep(0.15)
            self.assertFalse(woken)
        self.publish(0.1)
        thread.join(START)
        self.assertTrue(woken)

    def test_messages_age_and_are_stamped_in_simulated_time(self):
        """Wall time must not age a message, and a clock that goes back must not make it younger."""
        self.publish(30.0)
        reader = self.middleware.reader("aged", "sensor_msgs/JointState")
        writer = self.middleware.writer("aged", "sensor_msgs/JointState")
        message = JointMessage(("hip",), position=np.zeros(1))

        def arrived() -> bool:
            writer.write(message)
            return reader.read() is MessageStatus.NEW

        wait_for(arrived, START, "a message")
        time.sleep(0.3)
        reader.read()
        self.assertEqual(reader.age(), 0.0)
        self.assertEqual(reader.message.stamp, 30.0)
        self.publish(30.75)
        self.assertAlmostEqual(reader.age(), 0.75, places=6)
        self.publish(1.0)
        self.assertAlmostEqual(reader.age(), 0.75, places=6)


if __name__ == "__main__":
    rostest.rosrun("solfer", "clock", ClockTest)
