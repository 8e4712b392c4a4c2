"""Lock-step of the simulator with plugins as nodes of ROS 2; needs the environment of `./run ros2`."""

import os
import signal
from contextlib import ExitStack, closing

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ./run ros2")

from rclpy.qos import QoSProfile  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from support.integration.world import STEP, World  # noqa: E402
from support.unit.ros2_nodes import Foreign, configured, start  # noqa: E402

from solfer.components.joint_states import MoveJoints as Motion  # noqa: E402
from solfer.errors import ConfigError  # noqa: E402
from solfer.middleware.ros2 import connect  # noqa: E402
from solfer.msg import JointCommand  # noqa: E402
from solfer.srv import MoveJoints  # noqa: E402

LISTED = ("joint_states", "upper_body")
LOCKSTEP = ("--ros-args", "-p", f"lockstep:={','.join(LISTED)}")
PERIOD = 5_000_000
"""Period of both plugins [ns]."""


JOINTS = ("neck_pitch", "torso_yaw")
TARGETS = (0.2, -0.4)


def nanoseconds(message):
    """Return the stamp of a message [ns]."""
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def in_memory(first, cycle, count):
    """Return `count` commands of the joints from the first one on.

    Args:
        first: Number of the cycle of the first command, that at 1 ms is zero; the plugin starts one before.
        cycle: Number of the command with which the motion begins.
        count: How many.
    """
    sent, begin = [], 1.0 + STEP / 2.0
    with closing(World()) as world:
        world.pause(True)
        world.asleep.add("joint_states")
        plugin = world.plugin("joint_states")
        world.bus.run_until(begin)
        world.pause(False)
        (pipe,) = [each for each, _ in plugin.outputs.controllers if each.name == "position_controller"]
        columns = [pipe.sent.names.index(each) for each in JOINTS]
        period = 1.0 / plugin.rate
        start_time = begin + STEP + (first - 1) * period
        world.bus.every(period, plugin.cycle, start_time, cycles=True)
        world.bus.every(period, lambda: sent.append(pipe.sent.position[columns]), start_time + period)
        world.bus.run_until(start_time + (cycle + 0.5) * period)
        plugin.component.trajectory(Motion(joints=JOINTS, positions=TARGETS))
        world.bus.run_until(start_time + (count + 0.5) * period)
    return np.array(sent)


class Observer(Foreign):
    """Keeps the joints' stamps, and commands of the plugins' topics, in the order of their coming."""

    def __init__(self):
        super().__init__(joints=False)
        self.stamps = []
        self.commands = {}
        self.node.create_subscription(JointCommand, "/position_controller/command", self._note, QoSProfile(depth=1000))
        self.node.create_subscription(JointState, "/joint_states", self._keep, QoSProfile(depth=1000))

    def _keep(self, message):
        self.stamps.append(nanoseconds(message))

    def _note(self, message):
        self.commands[nanoseconds(message)] = dict(zip(message.name, message.position, strict=True))

    def time(self):
        """Return the simulated time of the newest joints [s]; they are published while time stands still, too."""
        return 1e-9 * self.stamps[-1] if self.stamps else 0.0

    def stands(self):
        """Return whether no time passes for half a second."""
        before = self.time()
        self.spin(0.5)
        return self.time() == before


@pytest.fixture
def observer(monkeypatch):
    """Make a node that is not ours; other tests on this machine stay outside."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    made = Observer()
    yield made
    made.close()


@pytest.mark.parametrize("value, error", [("arm,/arm", "a node twice"), ("3", "not a list of nodes")])
def test_a_wrong_list_is_refused(value, error):
    with pytest.raises(ConfigError, match=error):
        connect("simulator", ["node", "--ros-args", "-p", f"lockstep:={value}"])


def plugin(stack, name, file):
    """Start a plugin in the lock-step."""
    return start(stack, "nodes/plugin", "-p", name, "-c", file, *LOCKSTEP)


@pytest.mark.soak
def test_time_waits_for_both_plugins(tmp_path, observer):
    """It stands still before a late one is there, passes with both, and stands still again when one is killed.

    All commands are those in memory, where the plugin starts and is asked to move in the same cycles.
    """
    file = configured(tmp_path)
    with ExitStack() as stack:
        start(stack, "nodes/simulator", "--factor", "0", "--perfect", *LOCKSTEP, "-p", "use_sim_time:=true")
        plugin(stack, LISTED[0], file)
        observer.spin(8.0)
        assert observer.stamps and observer.stands()
        killed = plugin(stack, LISTED[1], file)
        observer.until(lambda: observer.time() > 0.5)
        client = observer.node.create_client(MoveJoints, "/joint_states/trajectory")
        observer.until(client.service_is_ready)
        request = MoveJoints.Request(joints=JOINTS, positions=TARGETS)
        assert observer.result(client.call_async(request)).success
        end = observer.time() + 2.0
        observer.until(lambda: observer.time() > end)
        killed.send_signal(signal.SIGKILL)
        observer.spin(0.5)
        assert observer.stands()
    stamps = sorted(observer.commands)
    assert set(np.diff(stamps)) == {PERIOD}
    found = np.array([[observer.commands[stamp][joint] for joint in JOINTS] for stamp in stamps])
    begin = int(np.argmax(np.any(np.diff(found, axis=0) != 0.0, axis=1))) + 1
    expected = in_memory((stamps[0] - 1_000_000) // PERIOD, begin, len(found))
    assert len(found) > 450 and np.ptp(expected, axis=0).min() > 0.15
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)
