"""A plugin and the simulator as nodes of ROS 2, and a node that is not ours; needs the environment of `./run ros2`."""

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

rclpy = pytest.importorskip("rclpy", reason="needs ./run ros2")

from rclpy.qos import qos_profile_sensor_data  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

from solfer.srv import MoveJoints  # noqa: E402

REPOSITORY = Path(__file__).resolve().parents[3]
PATIENCE = 60.0
"""Longest wait for what another process does [s]."""


class Foreign:
    """A node of rclpy alone."""

    def __init__(self):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("foreign", context=self.context)
        self.executor = rclpy.executors.SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.positions = {}
        self.node.create_subscription(JointState, "/joint_states", self._receive, qos_profile_sensor_data)

    def _receive(self, message):
        self.positions = dict(zip(message.name, message.position, strict=True))

    def until(self, condition):
        """Spin until a condition holds."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "it has not come"
            self.executor.spin_once(timeout_sec=0.05)

    def result(self, future):
        """Spin until a result is there."""
        self.until(future.done)
        return future.result()

    def close(self):
        """End the node."""
        self.node.destroy_node()
        self.context.shutdown()


def start(stack, *command):
    """Start a node, which ends by Ctrl-C."""
    process = subprocess.Popen(
        [sys.executable, *command], cwd=REPOSITORY, stderr=subprocess.STDOUT, stdout=subprocess.PIPE
    )

    def end():
        process.send_signal(signal.SIGINT)
        output = process.communicate(timeout=30)[0].decode()
        assert process.returncode == 0 and "Traceback" not in output, output

    stack.callback(end)


@pytest.mark.soak
def test_a_node_that_is_not_ours_moves_the_neck(tmp_path, monkeypatch):
    """It reads the joints, requests a motion, is refused a joint that there is not, and changes a parameter's value."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    text, count = re.subn(
        r"^  middleware: ROS\b", "  middleware: ROS2", (REPOSITORY / "config/centauro.yaml").read_text(), flags=re.M
    )
    assert count == 1
    file = REPOSITORY / "config" / f"centauro_ros2_{os.getpid()}.yaml"
    file.write_text(text)
    with ExitStack() as stack:
        stack.callback(file.unlink)
        start(stack, "nodes/simulator", "--engine", "mujoco")
        start(stack, "nodes/plugin", "-p", "joint_states", "-c", str(file))
        foreign = Foreign()
        stack.callback(foreign.close)
        foreign.until(lambda: foreign.positions)
        client = foreign.node.create_client(MoveJoints, "/joint_states/trajectory")
        foreign.until(client.service_is_ready)

        def move(joint):
            return foreign.result(client.call_async(MoveJoints.Request(joints=[joint], positions=[0.2])))

        foreign.until(lambda: move("neck_pitch").success)  # refused until the plugin runs
        foreign.until(lambda: abs(foreign.positions["neck_pitch"] - 0.2) < 0.01)
        refused = move("neck_pich")
        assert not refused.success and "neck_pitch" in refused.message
