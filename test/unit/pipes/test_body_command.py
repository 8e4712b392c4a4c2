"""Published pose and twist of a link, against SciPy's rotations and against the pipe that receives them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from support.unit.body_feedback import DESCRIPTION, DESCRIPTION_DOFS, Q, V, make, truth
from support.unit.endpoints import KeptWriter

from solfer.config.records.conventions import ConventionRecord
from solfer.model import Kinematics, State
from solfer.model.state import POSE_COVARIANCE, TWIST_COVARIANCE
from solfer.pipes.body.command import BodyCommandPipe, PublishedLink
from solfer.transport import MessageStatus

LINK = "sensor"
CONVENTIONS = [
    {"orientation": {"order": order, "convention": kind}, "twist": {"frame": frame}}
    for order in ("xyzw", "wxyz")
    for kind in ("HAMILTONIAN", "JPL")
    for frame in ("world", "body")
]


def publish(message, **tags):
    """Return the message that a pipe sends for a link of a moving robot."""
    state, writer = State(DESCRIPTION_DOFS), KeptWriter()
    state.position[:], state.velocity[:] = Q, V
    convention = ConventionRecord.model_validate(tags)
    pipe = BodyCommandPipe(
        "pipe", writer, message, Kinematics(DESCRIPTION), state, link=PublishedLink(LINK, convention)
    )
    pipe.collect()
    pipe.send(2.5)
    return writer.messages[0]


def test_odometry_holds_pose_and_twist_in_the_world():
    position, rotation, linear, angular = truth(LINK)
    message = publish("nav_msgs/Odometry")
    assert (message.frame, message.child, message.stamp) == ("world", LINK, 2.5)
    assert_allclose(message.position, position, atol=1e-14)
    assert_allclose(Rotation.from_quat(message.orientation).as_matrix(), rotation.as_matrix(), atol=1e-14)
    assert_allclose(message.linear, linear, atol=1e-13)
    assert_allclose(message.angular, angular, atol=1e-13)


def test_odometry_carries_the_covariances_of_who_estimates_the_base():
    state, writer = State(DESCRIPTION_DOFS), KeptWriter()
    known = state.add(POSE_COVARIANCE, 36), state.add(TWIST_COVARIANCE, 36)
    kinematics, names = Kinematics(DESCRIPTION), ("nav_msgs/Odometry", LINK)
    pipe = BodyCommandPipe(
        "pipe", writer, names[0], kinematics, state, link=PublishedLink(LINK, ConventionRecord(), "odom", known)
    )
    state[POSE_COVARIANCE][:], state[TWIST_COVARIANCE][:] = np.arange(36.0), np.arange(36.0, 72.0)
    pipe.collect()
    pipe.send(2.5)
    (message,) = writer.messages
    assert message.frame == "odom"
    assert_allclose(message.pose_covariance, np.arange(36.0).reshape(6, 6))
    assert_allclose(message.twist_covariance, np.arange(36.0, 72.0).reshape(6, 6))
    assert not publish("nav_msgs/Odometry").pose_covariance.any()


@pytest.mark.parametrize("order, kind", [("xyzw", "HAMILTONIAN"), ("wxyz", "HAMILTONIAN"), ("wxyz", "JPL")])
def test_poses_and_orientations_are_written_in_the_convention(order, kind):
    position, rotation, _, _ = truth(LINK)
    expected = (rotation if kind == "HAMILTONIAN" else rotation.inv()).as_quat(scalar_first=order == "wxyz")
    tags = {"orientation": {"order": order, "convention": kind}}
    pose = publish("geometry_msgs/PoseStamped", **tags)
    assert_allclose(pose.values[:3], position, atol=1e-14)
    for quaternion in (pose.values[3:], publish("geometry_msgs/QuaternionStamped", **tags).values):
        assert_allclose(quaternion * np.sign(quaternion @ expected), expected, atol=1e-14)


@pytest.mark.parametrize("frame", ["world", "body"])
def test_twists_name_the_frame_of_their_axes(frame):
    _, rotation, linear, angular = truth(LINK)
    message = publish("geometry_msgs/TwistStamped", twist={"frame": frame})
    turn = rotation.inv() if frame == "body" else Rotation.identity()
    assert message.frame == (LINK if frame == "body" else "world")
    assert_allclose(message.values, np.concatenate((turn.apply(linear), turn.apply(angular))), atol=1e-13)


@pytest.mark.parametrize("tags", CONVENTIONS)
def test_a_receiver_of_the_convention_gets_the_base(tags):
    pipe, reader, state = make("nav_msgs/Odometry", LINK, **tags)
    reader.publish(publish("nav_msgs/Odometry", **tags))
    assert pipe.run() is MessageStatus.NEW
    assert_allclose(state.position, Q, atol=1e-12)
    assert_allclose(state.velocity, V, atol=1e-12)
