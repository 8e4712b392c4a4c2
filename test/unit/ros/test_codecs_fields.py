"""Messages of declared topics against genpy's own serialisation, and the checksums of what is generated."""

import math
from dataclasses import dataclass

import control_msgs.msg as control_messages
import geometry_msgs.msg as geometry_messages
import pytest
import rospy
import sensor_msgs.msg as sensor_messages
import trajectory_msgs.msg as trajectory_messages
from actionlib_msgs.msg import GoalID
from support.unit.declarations import Header, Twist, TwistStamped, Vector
from support.unit.genpy_messages import clock, packed  # noqa: F401, a fixture

from solfer.errors import ComponentError, MissingDependency, PipeError, UnknownName
from solfer.interfaces.geometry import Vector as Coordinates
from solfer.interfaces.ground import GroundEstimate
from solfer.middleware.ros.codecs.fields import require_fields
from solfer.middleware.ros.codecs.table import codec
from solfer.msg import Ground
from solfer.transport.declared.fields import message_of, value_of
from solfer.transport.messages import FieldsMessage

CHECKSUMS = {
    "FollowJointTrajectoryAction": "bc4f9b743838566551c0390c65f1a248",
    "FollowJointTrajectoryActionGoal": "cff5c1d533bf2f82dd0138d57f4304bb",
    "FollowJointTrajectoryActionFeedback": "d8920dc4eae9fc107e00999cce4be641",
    "FollowJointTrajectoryActionResult": "c4fb3b000dc9da4fd99699380efcc5d9",
    "JointTolerance": "f544fe9c16cf04547e135dd6063ff5be",
}
"""Of the control_msgs of ROS Noetic."""


def test_a_ground_is_what_genpy_reads():
    """Friction that was not felt stays NaN, and the frame is that of odometry."""
    known = codec("solfer/Ground")
    felt = GroundEstimate(
        names=("a", "b"), normals=(Coordinates(-0.6, 0.0, 0.8), Coordinates(z=1.0)), friction=(math.nan, 0.4)
    )
    read = Ground().deserialize(bytes(known.encode(message_of("solfer/Ground", felt)).bytes[4:]))
    assert read.header.frame_id == "odom" and read.header.stamp and read.names == ["a", "b"]
    assert (read.normals[0].x, read.normals[0].z, read.normal.z) == (-0.6, 0.8, 1.0)
    assert math.isnan(read.friction[0]) and read.friction[1] == 0.4
    again = value_of(GroundEstimate, known.decode(packed(read), "odometry"))
    assert again.normals == felt.normals and math.isnan(again.friction[0])


@pytest.mark.parametrize("name", CHECKSUMS)
def test_generated_messages_have_the_known_checksums(name):
    assert getattr(control_messages, name)._md5sum == CHECKSUMS[name]


def test_an_unstamped_message_is_what_genpy_reads():
    twist = codec("geometry_msgs/Twist")
    sent = twist.encode(message_of("geometry_msgs/Twist", Twist(Vector(1.0, 2.0), Vector(z=-3.0))))
    read = geometry_messages.Twist().deserialize(bytes(sent.bytes[4:]))
    assert (read.linear.x, read.linear.y, read.angular.z) == (1.0, 2.0, -3.0)
    again = twist.decode(packed(read), "stick")
    assert value_of(Twist, again) == Twist(Vector(1.0, 2.0), Vector(z=-3.0)) and again.sender == "stick"


def test_nested_fields_times_and_lists_come_back():
    """Times, negative durations, UTF-8 and lists of messages of an action's goal: genpy's bytes are the oracle."""
    goal = control_messages.FollowJointTrajectoryActionGoal(goal_id=GoalID(rospy.Time(7, 500000000), "ä-1"))
    goal.header.frame_id = "wörld"
    goal.goal.trajectory.joint_names = ["a", "b"]
    goal.goal.trajectory.points = [
        trajectory_messages.JointTrajectoryPoint(positions=[1.0, 2.0], time_from_start=rospy.Duration(2.25))
    ]
    goal.goal.goal_time_tolerance = rospy.Duration(-1.5)
    known = codec("control_msgs/FollowJointTrajectoryActionGoal")
    decoded = known.decode(packed(goal), "client")
    assert decoded.fields["goal_id"] == {"stamp": 7.5, "id": "ä-1"}
    assert decoded.fields["goal"]["trajectory"]["points"][0]["time_from_start"] == 2.25
    read = control_messages.FollowJointTrajectoryActionGoal().deserialize(bytes(known.encode(decoded).bytes[4:]))
    assert read.header.frame_id == "wörld" and read.header.stamp > rospy.Time(1)
    goal.header = read.header
    assert packed(read) == packed(goal)


def test_arrays_of_bytes_and_of_a_fixed_size():
    image = sensor_messages.Image(height=1, width=3, data=b"\x01\x02\x03")
    known = codec("sensor_msgs/Image")
    decoded = known.decode(packed(image), "camera")
    assert decoded.fields["data"] == (1, 2, 3)
    assert sensor_messages.Image().deserialize(bytes(known.encode(decoded).bytes[4:])).data == b"\x01\x02\x03"


def test_a_value_of_another_type_is_refused():
    with pytest.raises(PipeError, match="no geometry_msgs/Twist can be made"):
        codec("geometry_msgs/Twist").encode(FieldsMessage({"linear": {"x": "fast"}}))
    with pytest.raises(PipeError, match="not a whole geometry_msgs/Twist"):
        codec("geometry_msgs/Twist").decode(b"123", "stick")


@dataclass
class Speed:
    """No message has these fields."""

    linear: Header = Header()


def test_fields_are_compared_with_the_interface():
    require_fields("geometry_msgs/Twist", Twist)
    require_fields("geometry_msgs/TwistStamped", TwistStamped)
    with pytest.raises(ComponentError, match="Header has a field 'stamp', geometry_msgs/Vector3 does not"):
        require_fields("geometry_msgs/Twist", Speed)
    with pytest.raises(ComponentError, match="Twist has a field 'linear'"):
        require_fields("geometry_msgs/Pose", Twist)
    with pytest.raises(UnknownName, match="Twits"):
        require_fields("geometry_msgs/Twits", Twist)
    with pytest.raises(MissingDependency, match="no Python module nothing_msgs"):
        require_fields("nothing_msgs/Twist", Twist)
