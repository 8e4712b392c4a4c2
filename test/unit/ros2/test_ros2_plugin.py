"""A plugin and the simulator as nodes of ROS 2, and a node that is not ours; needs the environment of `./run ros2`."""

import os
import subprocess
import sys
from contextlib import ExitStack

import pytest

pytest.importorskip("rclpy", reason="needs ./run ros2")

from action_msgs.msg import GoalStatus  # noqa: E402
from builtin_interfaces.msg import Duration  # noqa: E402
from control_msgs.action import FollowJointTrajectory  # noqa: E402
from rclpy.action import ActionClient  # noqa: E402
from support.unit.ros2_nodes import Foreign, page, start_both  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint  # noqa: E402

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
        follow(foreign)


def follow(foreign):
    """Send goals by the protocol of ROS 2: one is cancelled on the way, one is carried out, one is refused by name."""
    client = ActionClient(foreign.node, FollowJointTrajectory, "/joint_states/follow_joint_trajectory")
    foreign.until(client.server_is_ready)
    feedbacks, transforms = [], []
    foreign.node.create_subscription(TFMessage, "/tf", transforms.append, 1)

    def send(position, seconds, name="neck_pitch"):
        point = JointTrajectoryPoint(positions=[position], time_from_start=Duration(sec=seconds))
        goal = FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=[name], points=[point]))
        return foreign.result(client.send_goal_async(goal, lambda each: feedbacks.append(each.feedback)))

    def end(goal):
        return foreign.result(goal.get_result_async())

    goal = send(-0.2, 20)
    assert goal.accepted
    foreign.until(lambda: len(feedbacks) > 5)
    assert list(feedbacks[-1].joint_names) == ["neck_pitch"] and -0.2 < feedbacks[-1].desired.positions[0] < 0.21
    assert foreign.result(goal.cancel_goal_async()).goals_canceling
    assert end(goal).status == GoalStatus.STATUS_CANCELED
    foreign.spin(0.5)
    resting = foreign.positions["neck_pitch"]
    assert resting > 0.1
    foreign.spin(0.5)
    assert abs(foreign.positions["neck_pitch"] - resting) < 1e-3
    done = end(send(0.0, 1))
    assert (done.status, done.result.error_code) == (GoalStatus.STATUS_SUCCEEDED, 0)
    assert abs(foreign.positions["neck_pitch"]) < 0.02
    replaced, newest = send(0.2, 20), send(0.1, 1)
    assert end(replaced).status == GoalStatus.STATUS_ABORTED and end(newest).status == GoalStatus.STATUS_SUCCEEDED
    refused = end(send(0.0, 1, "neck_pich"))
    assert (refused.status, refused.result.error_code) == (GoalStatus.STATUS_ABORTED, -2)
    assert "neck_pitch" in refused.result.error_string
    pose = transforms[-1].transforms[0]
    assert (pose.header.frame_id, pose.child_frame_id) == ("world", "pelvis")
    assert 0.5 < pose.transform.translation.z < 1.5
