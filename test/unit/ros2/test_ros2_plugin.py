"""A plugin and the simulator as nodes of ROS 2, and a node that is not ours; needs the environment of `./run ros2`."""

import os
from contextlib import ExitStack

import pytest

pytest.importorskip("rclpy", reason="needs ./run ros2")

from support.unit.ros2_nodes import Foreign, configured, start  # noqa: E402

from solfer.srv import MoveJoints  # noqa: E402


@pytest.mark.soak
def test_a_node_that_is_not_ours_moves_the_neck(tmp_path, monkeypatch):
    """It reads the joints, requests a motion, is refused a joint that there is not, and changes a parameter's value."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    with ExitStack() as stack:
        start(stack, "nodes/simulator", "--engine", "mujoco")
        start(stack, "nodes/plugin", "-p", "joint_states", "-c", configured(tmp_path))
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
