"""A plugin and the simulator as nodes of ROS 2, and a node that is not ours; needs the environment of `./run ros2`."""

import os
import subprocess
import sys
from contextlib import ExitStack

import pytest

pytest.importorskip("rclpy", reason="needs ./run ros2")

from support.unit.ros2_nodes import Foreign, page, start_both  # noqa: E402

from solfer.srv import MoveJoints  # noqa: E402


@pytest.mark.soak
def test_a_node_that_is_not_ours_moves_the_neck(tmp_path, monkeypatch):
    """Simulator, plugin and node of docs/how-to/ros2.md: a motion is carried out, and one of no joint is refused."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    with ExitStack() as stack:
        start_both(stack, tmp_path)
        foreign = Foreign()
        stack.callback(foreign.close)
        foreign.until(lambda: foreign.positions)
        client = foreign.node.create_client(MoveJoints, "/joint_states/trajectory")
        foreign.until(client.service_is_ready)

        def move(joint):
            return foreign.result(client.call_async(MoveJoints.Request(joints=[joint], positions=[0.2])))

        foreign.until(lambda: foreign.text("joint_states: joint_states").startswith("running"))
        done = subprocess.run([sys.executable, "-c", page("python")], capture_output=True, text=True, check=True)
        assert "success=True" in done.stdout
        foreign.until(lambda: abs(foreign.positions["neck_pitch"] - 0.2) < 0.01)
        refused = move("neck_pich")
        assert not refused.success and "neck_pitch" in refused.message
