#!/usr/bin/env python3
"""The processes of Fig. 5 in drawn orders, as nodes of ROS and as a real-time layer: the robot drives in each.

A robot whose simulator was killed before leaves its parameters on the master, and is not the one that plugins take.
"""

import contextlib
import math
import os
import random
import shutil
import signal
import time
import unittest
from pathlib import Path

import rospy
import rostest
from nav_msgs.msg import Odometry
from system import CENTAURO, SOAKS, START, program, started, wait_for

FIGURE = CENTAURO.parent / "figures" / "figure_5.yaml"
NAMESPACE = f"orders-{os.getpid()}"
APART = 0.5
"""Time between two starts [s]."""

DISTANCE, NEAR = 0.2, 0.03
"""How far it drives, and how near it comes [m]."""
SETTLES = 5.0
"""Longest time until the robot has followed the reference that navigation has ended [s]."""

NAVIGATION = program("navigation", "go", "--target", "locomotion", f"{DISTANCE},0.0")
ROS = {
    "simulator": program("simulator"),
    "hands": program("plugin", "-p", "inverse_kinematics", "-n", "hands", "-c", str(CENTAURO)),
    "full_control": program("plugin", "-p", "shared", "-n", "full_control", "-c", str(CENTAURO)),
    "navigation": NAVIGATION,
}
LAYER = {
    "simulator": program("xbot_simulator", "--namespace", NAMESPACE),
    "layer": program("xbot", str(FIGURE), "--namespace", NAMESPACE, "--rate", "200"),
    "bridge": program("xbot_bridge", str(FIGURE), "--namespace", NAMESPACE),
    "navigation": NAVIGATION,
}


def drawing():
    """Return what draws by the seed of the day or of the environment."""
    return random.Random(os.environ.get("SEED", time.strftime("%Y-%m-%d")))


def drawn(names, count):
    """Draw orders of names."""
    draw = drawing()
    orders = set()
    while len(orders) < count:
        orders.add(tuple(draw.sample(sorted(names), len(names))))
    return sorted(orders)


class OrdersTest(unittest.TestCase):
    """One order a day, of the one or the other; 12 of the 24 of each in a soak."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")

    def tearDown(self):
        shutil.rmtree(Path("/dev/shm") / f"solfer-{NAMESPACE}", ignore_errors=True)

    def drives(self, programs, order):
        """Start processes one after the other, and wait until navigation has arrived."""
        places = []
        subscriber = rospy.Subscriber(
            "/floating_base", Odometry, lambda message: places.append(message.pose.pose.position)
        )
        try:
            with contextlib.ExitStack() as stack:
                processes = {}
                for name in order:
                    processes[name] = stack.enter_context(started(*programs[name]))
                    time.sleep(APART)
                wait_for(
                    lambda: processes["navigation"].poll() is not None,
                    3.0 * START,
                    f"a robot that arrives, after {order}",
                )
                self.assertEqual(processes["navigation"].returncode, 0, processes["navigation"].stdout.read())
                wait_for(
                    lambda: self.away(places[-1]) < NEAR,
                    SETTLES,
                    lambda: f"a robot that was sent there, {self.away(places[-1]):.3f} m away, after {order}",
                )
                others = sorted(processes.keys() - {"navigation", "simulator"})
                for name in others:
                    processes[name].send_signal(signal.SIGINT)
                for name in others:
                    output, _ = processes[name].communicate(timeout=START)
                    code = processes[name].returncode
                    self.assertEqual(code, 0, output)
        finally:
            subscriber.unregister()

    @staticmethod
    def away(place):
        """Return the distance of the true base from where it was sent [m]."""
        return math.dist((place.x, place.y), (DISTANCE, 0.0))

    def test_they_drive_in_each_order(self):
        """The simulator is killed in the end, so that the next order begins with what it has left on the master."""
        for programs in (ROS, LAYER) if SOAKS else (drawing().choice((ROS, LAYER)),):
            for order in drawn(programs, 12 if SOAKS else 1):
                self.drives(programs, order)


if __name__ == "__main__":
    rostest.rosrun("solfer", "orders", OrdersTest)
