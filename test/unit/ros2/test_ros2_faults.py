"""Faults of nodes of `middleware: ROS2`, in processes of their own; needs the environment of `./run ros2`."""

import os
import subprocess
import sys
from contextlib import ExitStack, closing

import pytest

pytest.importorskip("rclpy", reason="needs ./run ros2")

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402
from support.unit.ros2_nodes import REPOSITORY, Foreign, start, start_both  # noqa: E402

from solfer.middleware.ros2 import connect  # noqa: E402

PLUGIN = "joint_states: joint_states"
FEEDBACK = f"{PLUGIN} feedback link_side_online"
RATE = 200


@pytest.fixture
def foreign(monkeypatch):
    """Make a node that is not ours; other tests on this machine stay outside."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    node = Foreign(joints=False)
    yield node
    node.close()


def test_qualities_that_do_not_fit_are_one_warning(foreign, caplog):
    """Both sides, the policies and the cure are named, once; a node that fits later is not."""
    with closing(connect("ours", ["node"])) as ours:
        best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        foreign.node.create_publisher(Float64, "/in", best_effort)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        foreign.node.create_subscription(Float64, "/out", print, latched)
        ours.queue("/in", "std_msgs/Float64")
        ours.writer("/out", "std_msgs/Float64")
        foreign.until(lambda: len(caplog.records) == 2)
        foreign.node.create_publisher(Float64, "/in", 1)
        foreign.spin(2.5)
    assert sorted(each.message for each in caplog.records) == [
        "topic /in: nothing of /foreign arrives, which publishes best effort where /ours requires reliable; "
        "expected: a publisher with reliability RELIABLE in /foreign",
        "topic /out: nothing arrives at /foreign, which requires transient local where /ours publishes volatile; "
        "expected: a subscription with durability VOLATILE in /foreign",
    ]


@pytest.mark.soak
def test_a_plugin_survives_a_killed_simulator_and_floods(tmp_path, foreign):
    """It holds with its reason while nobody publishes, goes on when somebody does, and keeps its rate in floods."""
    with ExitStack() as stack:
        simulator = start_both(stack, tmp_path)
        foreign.until(lambda: foreign.text(PLUGIN) == "running")
        simulator.kill()
        foreign.until(lambda: "holds and waits for feedback 'link_side_online'" in foreign.text(PLUGIN))
        foreign.until(lambda: "nothing new on /joint_states" in foreign.text(FEEDBACK))
        start(stack, "nodes/simulator", "--engine", "mujoco")
        foreign.until(lambda: foreign.text(PLUGIN) == "running")
        for kind in ("topic", "service"):
            before = foreign.count(PLUGIN, "cycles"), foreign.count(PLUGIN, "skipped periods")
            flood = subprocess.Popen(
                [sys.executable, REPOSITORY / "test/support/unit/ros2_flood.py", kind, "5"], stdout=subprocess.PIPE
            )
            foreign.until(lambda flood=flood: flood.poll() is not None)
            skipped = foreign.count(PLUGIN, "skipped periods") - before[1]
            cycles = foreign.count(PLUGIN, "cycles") - before[0]
            assert int(flood.stdout.read()) > 5000
            assert foreign.text(FEEDBACK) == "received"
            # on two processors a process that only computes costs up to 13 %
            assert skipped < 0.2 * (cycles + skipped) and cycles > 0.8 * 5 * RATE
