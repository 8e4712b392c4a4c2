#!/usr/bin/env python3
"""A ROS master that is gone, or is another one, under nodes that turn wheels: they end, and the wheels stand still."""

import contextlib
import os
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

import rospy
import rostest
from sensor_msgs.msg import JointState
from system import START, insist, soak, started, wait_for

from solfer.middleware.ros.node.launch import free_port
from solfer.msg import JointCommand

REPOSITORY = Path(os.path.realpath(__file__)).parents[2]
WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")
PORT = free_port()
SIMULATOR = (sys.executable, str(REPOSITORY / "nodes" / "simulator"))
PLUGIN = (
    sys.executable,
    str(REPOSITORY / "nodes" / "plugin"),
    "-p",
    "joint_states",
    "-c",
    str(REPOSITORY / "config" / "centauro.yaml"),
)

BLIND = (
    sys.executable,
    "-c",
    f"""
import runpy, sys
import solfer.middleware.ros.node.node as node
class Blind:
    loss = ""
    def __init__(self, *args, **named): pass
    def close(self): pass
node.MasterWatch = Blind
sys.argv[0] = {SIMULATOR[1]!r}
runpy.run_path(sys.argv[0], run_name="__main__")
""",
)
"""A robot that does not care about the master, as real ones do."""


class Master:
    """A master on PORT, that answers."""

    def __init__(self):
        self._process = subprocess.Popen(
            ["rosmaster", "--core", "-p", str(PORT)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        wait_for(self._answers, START, "a master")

    def signal(self, number):
        """Send a signal to its process."""
        self._process.send_signal(number)

    def kill(self):
        """End it as nothing else does."""
        self._process.kill()
        self._process.wait()

    def _answers(self):
        with contextlib.suppress(OSError):
            return bool(rospy.get_master().getPid())


class Observer:
    """Joint states and commands of the wheels, over connections that outlive their master."""

    def __init__(self):
        self.published, self.commanded, self.count = JointState(), JointCommand(), 0
        self._ends = [
            rospy.Subscriber("/joint_states", JointState, self._receive_joints, queue_size=1),
            rospy.Subscriber("/velocity_controller/command", JointCommand, self._receive_command, queue_size=1),
        ]
        wait_for(lambda: bool(self.published.name), START, "joint states")

    def speeds(self):
        """Speeds of the wheels [rad/s]."""
        published = dict(zip(self.published.name, self.published.velocity, strict=True))
        return [published[name] for name in WHEELS]

    def turns(self):
        """Return whether the wheels turn as commanded."""
        return min(self.speeds()) > 0.9

    def close(self):
        """Observe no more."""
        for end in self._ends:
            end.unregister()

    def _receive_joints(self, message):
        self.published, self.count = message, self.count + 1

    def _receive_command(self, message):
        self.commanded = message


class MasterTest(unittest.TestCase):
    """Each test has a master, a simulated robot and a plugin that turns its wheels at 1 rad/s."""

    @classmethod
    def setUpClass(cls):
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{PORT}"
        master = Master()
        rospy.init_node("master_test", disable_signals=True)
        master.kill()

    def setUp(self):
        self.master = Master()
        self.addCleanup(lambda: self.master.kill())

    def ends(self, name, process):
        """Check that a node ends by itself with exit code 2 and one line with the reason.

        On a busy machine the next master may need longer than nodes wait for the one before.
        """
        output, _ = process.communicate(timeout=START)
        self.assertEqual(process.returncode, 2, output)
        errors = [line for line in output.splitlines() if "error:" in line]
        self.assertEqual(len(errors), 1, output)
        self.assertRegex(errors[0], f"error: node {name} ends: (another ROS master|the ROS master does not answer)")
        self.assertNotIn("Traceback", output)

    def start_anew(self):
        """Replace the master that all are registered with by another one."""
        self.master.kill()
        self.master = Master()

    @contextlib.contextmanager
    def driving(self, robot):
        """Run a robot, and a plugin that turns its wheels."""
        with started(*robot) as simulator, contextlib.closing(Observer()) as observer, started(*PLUGIN) as plugin:
            wait_for(
                lambda: insist(plugin, joints=WHEELS, velocities=[1.0] * 4) and observer.turns(),
                START,
                "wheels that turn",
            )
            yield simulator, plugin, observer

    def test_another_master_ends_the_plugin_at_rest(self):
        with self.driving(BLIND) as (simulator, plugin, observer):
            self.start_anew()
            self.ends("/joint_states", plugin)
            wait_for(lambda: set(observer.commanded.velocity) == {0.0}, START, "zero as the last command to the wheels")
            wait_for(lambda: max(map(abs, observer.speeds())) < 0.05, START, "wheels at rest")
            before = observer.count
            wait_for(lambda: observer.count > before + 200, START, "a robot that is still there")
            self.assertLess(max(map(abs, observer.speeds())), 0.05)
            self.assertIsNone(simulator.poll())

    @soak
    def test_another_master_ends_the_simulator_at_rest(self):
        with started(*SIMULATOR) as simulator, contextlib.closing(Observer()) as observer:
            sender = rospy.Publisher("/velocity_controller/command", JointCommand, queue_size=1)
            command = JointCommand(name=WHEELS, velocity=[1.0] * 4)
            timer = rospy.Timer(rospy.Duration(0.02), lambda event: sender.publish(command))
            try:
                wait_for(observer.turns, START, "wheels that turn")
                self.start_anew()
                self.ends("/simulator", simulator)
                self.assertLess(max(map(abs, observer.speeds())), 0.05, "with a request of 1 rad/s that never ends")
            finally:
                timer.shutdown()
                timer.join()
                sender.unregister()

    @soak
    def test_a_master_that_stays_away_ends_all(self):
        """A master that pauses for 3 s is tolerated; one that dies ends both nodes, and the last command is zero."""
        with self.driving(SIMULATOR) as (simulator, plugin, observer):
            self.master.signal(signal.SIGSTOP)
            time.sleep(3.0)
            self.master.signal(signal.SIGCONT)
            before = observer.count
            wait_for(lambda: observer.count > before + 400, START, "a robot that goes on")
            self.assertIsNone(simulator.poll())
            self.assertIsNone(plugin.poll())
            insist(plugin, joints=WHEELS, velocities=[1.0] * 4)
            wait_for(observer.turns, START, "wheels that turn")
            self.master.kill()
            for name, process in (("/joint_states", plugin), ("/simulator", simulator)):
                self.ends(name, process)
            self.assertLess(max(map(abs, observer.speeds())), 0.05)
            self.assertEqual(set(observer.commanded.velocity), {0.0})


if __name__ == "__main__":
    rostest.rosrun("solfer", "master", MasterTest)
