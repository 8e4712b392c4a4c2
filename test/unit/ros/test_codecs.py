"""The ROS codecs against genpy's own serialisation, and against SciPy's rotations."""

import itertools

import geometry_msgs.msg as geometry_messages
import nav_msgs.msg as nav_messages
import numpy as np
import pytest
import rospy
import sensor_msgs.msg as sensor_messages
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation
from support.unit.genpy_messages import clock, packed  # noqa: F401, a fixture

from solfer.errors import PipeError
from solfer.middleware.ros.codecs.table import codec
from solfer.msg import JointCommand
from solfer.transport import BodyMessage, ImuMessage, JointMessage, WrenchMessage

NAMES = ("hip", "knie_ä", "wheel")


@pytest.fixture
def joints():
    return codec("sensor_msgs/JointState")


@pytest.fixture
def body():
    return codec("nav_msgs/Odometry")


def sent(frame) -> bytes:
    """Return the bytes on the wire, without their length, which is checked."""
    assert int.from_bytes(frame.bytes[:4], "little") == len(frame.bytes) - 4
    return bytes(frame.bytes[4:])


def joint_state(**fields) -> bytes:
    """Pack a sensor_msgs/JointState by genpy."""
    return packed(sensor_messages.JointState(name=list(NAMES), **fields))


def test_an_encoded_joint_message_is_what_genpy_reads(joints):
    message = JointMessage(NAMES, position=np.array([0.1, -2.0, 3e8]), effort=np.array([1.0, 2.0, 3.0]))
    before = rospy.Time.now()
    read = sensor_messages.JointState().deserialize(sent(joints.encode(message)))
    assert tuple(read.name) == NAMES
    assert_array_equal(read.position, message.position)
    assert read.velocity == ()
    assert_array_equal(read.effort, message.effort)
    assert before <= read.header.stamp <= rospy.Time.now()


def test_the_numbers_of_a_written_message_are_copied(joints):
    message = JointMessage(NAMES, position=np.zeros(3))
    frame = joints.encode(message)
    before = sent(frame)
    message.position[:] = 1.0
    assert sent(frame) == before
    assert sensor_messages.JointState().deserialize(sent(joints.encode(message))).position == (1.0, 1.0, 1.0)


def test_a_joint_message_of_genpy_is_decoded(joints):
    state = sensor_messages.JointState(name=list(NAMES), velocity=[1.0, 2.0, 3.0])
    state.header.frame_id = "any"
    state.header.stamp = rospy.Time(12, 500000000)
    message = joints.decode(packed(state), "/sender")
    assert (message.names, message.stamp, message.sender) == (NAMES, 12.5, "/sender")
    assert message.position is None and message.effort is None and message.stiffness is None
    assert_array_equal(message.velocity, [1.0, 2.0, 3.0])


def test_names_are_read_anew_when_they_change(joints):
    assert joints.decode(joint_state(), "").names == NAMES
    for names in (("knee", "hip", "wheel"), ("hip",), (), (*NAMES, "more"), NAMES):
        read = joints.decode(packed(sensor_messages.JointState(name=list(names))), "")
        assert read.names == names


@pytest.mark.parametrize("size", [1, 2, 4])
def test_an_array_of_wrong_length_is_refused(joints, size):
    with pytest.raises(PipeError, match=f"{size} numbers in 'velocity' for 3 names"):
        joints.decode(joint_state(position=[0.0] * 3, velocity=[0.0] * size), "")


def test_a_command_names_its_component():
    command = codec("solfer/JointCommand")
    for component in ("", "drives", "sch\u00f6n", "dri"):
        message = JointMessage(NAMES, velocity=np.ones(3), component=component)
        data = sent(command.encode(message))
        assert JointCommand().deserialize(data).component == component
        assert command.decode(data, "/limbs").component == component
        assert command.decode(data, "/limbs").claimant == (f"/limbs#{component}" if component else "/limbs")
        for wrong in (data[:-1], data + b"x"):
            with pytest.raises(PipeError):
                command.decode(wrong, "/limbs")
    assert command.decode(packed(JointCommand(name=list(NAMES))), "/limbs").claimant == "/limbs"


def test_bytes_that_end_anywhere_are_refused(joints, body):
    whole = joint_state(position=[0.0] * 3, velocity=[1.0] * 3, effort=[2.0] * 3)
    for length in range(len(whole)):
        with pytest.raises(PipeError):
            joints.decode(whole[:length], "")
    with pytest.raises(PipeError):
        joints.decode(whole + b"x", "")
    odometry = packed(nav_messages.Odometry())
    with pytest.raises(PipeError):
        body.decode(odometry[:-1], "")


def test_bytes_by_chance_are_refused_or_read(joints):
    rng = np.random.default_rng(1)
    whole = np.frombuffer(joint_state(position=[0.0] * 3), np.uint8)
    for _ in range(500):
        broken = whole.copy()
        broken[rng.integers(len(broken), size=3)] = rng.integers(256, size=3)
        try:
            message = joints.decode(broken.tobytes(), "")
        except PipeError:
            continue
        assert message.position is None or len(message.position) == len(message.names)


def test_twist_of_odometry_is_in_child_axes(body):
    rotation = Rotation.from_rotvec([0.3, -1.1, 0.7])
    linear, angular = np.array([1.0, 2.0, 3.0]), np.array([-0.1, 0.2, 0.5])
    message = BodyMessage("world", "pelvis", np.array([4.0, 5.0, 6.0]), rotation.as_quat(), linear, angular)
    read = nav_messages.Odometry().deserialize(sent(body.encode(message)))
    assert (read.header.frame_id, read.child_frame_id) == ("world", "pelvis")
    twist = read.twist.twist
    assert_allclose([twist.linear.x, twist.linear.y, twist.linear.z], rotation.inv().apply(linear))
    assert_allclose([twist.angular.x, twist.angular.y, twist.angular.z], rotation.inv().apply(angular))
    back = body.decode(sent(body.encode(message)), "/sender")
    assert (back.frame, back.child, back.sender) == ("world", "pelvis", "/sender")
    for name in ("position", "orientation", "linear", "angular"):
        assert_allclose(getattr(back, name), getattr(message, name), atol=1e-12)


def test_covariances_of_odometry_go_there_and_back(body):
    known = np.arange(1.0, 37.0).reshape(6, 6)
    message = BodyMessage("odom", "pelvis", pose_covariance=known, twist_covariance=-2.0 * known)
    read = nav_messages.Odometry().deserialize(sent(body.encode(message)))
    assert read.pose.covariance == tuple(known.ravel()) and read.twist.covariance == tuple(-2.0 * known.ravel())
    assert (read.pose.pose.orientation.w, read.twist.twist.linear.x) == (1.0, 0.0)
    back = body.decode(packed(read), "")
    assert_array_equal(back.pose_covariance, known)
    assert_array_equal(back.twist_covariance, -2.0 * known)
    unknown = nav_messages.Odometry().deserialize(sent(body.encode(BodyMessage("odom", "pelvis"))))
    assert not any(unknown.pose.covariance) and not any(unknown.twist.covariance)


@pytest.mark.parametrize("w", [0.0, 0.9, 1.1, float("nan")])
def test_an_orientation_without_unit_norm_is_refused(body, w):
    odometry = nav_messages.Odometry()
    odometry.pose.pose.orientation.w = w
    with pytest.raises(PipeError, match="orientation"):
        body.decode(packed(odometry), "")


def test_an_inertial_measurement_goes_there_and_back():
    """What the codec writes, genpy reads: order of the quaternion, covariance from deviations, frame and sender."""
    rotation = Rotation.from_rotvec([0.2, 0.4, -1.3])
    message = ImuMessage(
        "imu_link", rotation.as_quat(), np.array([0.1, -0.2, 0.3]), np.array([1.0, 2.0, 9.0]), (0.01, 0.02, 0.5)
    )
    imu = codec("sensor_msgs/Imu")
    read = sensor_messages.Imu().deserialize(sent(imu.encode(message)))
    assert read.header.frame_id == "imu_link"
    assert [read.orientation.x, read.orientation.w] == [message.orientation[0], message.orientation[3]]
    assert [read.angular_velocity.x, read.angular_velocity.z] == [0.1, 0.3]
    assert read.linear_acceleration.z == 9.0
    assert_allclose(read.linear_acceleration_covariance, 0.25 * np.eye(3).ravel())
    back = imu.decode(sent(imu.encode(message)), "/sender")
    assert (back.frame, back.sender) == ("imu_link", "/sender")
    for name in ("orientation", "angular", "acceleration", "deviations"):
        assert_allclose(getattr(back, name), getattr(message, name), atol=1e-15)


def test_a_wrench_goes_there_and_back():
    message = WrenchMessage("wheel_1", np.array([1.0, -2.0, 300.0]), np.array([0.5, 0.25, -0.125]))
    wrench = codec("geometry_msgs/WrenchStamped")
    read = geometry_messages.WrenchStamped().deserialize(sent(wrench.encode(message)))
    assert read.header.frame_id == "wheel_1"
    assert (read.wrench.force.z, read.wrench.torque.z) == (300.0, -0.125)
    back = wrench.decode(sent(wrench.encode(message)), "/sender")
    assert (back.frame, back.sender) == ("wheel_1", "/sender")
    assert_array_equal([back.force, back.torque], [message.force, message.torque])


@pytest.mark.parametrize("name", ["sensor_msgs/Imu", "geometry_msgs/WrenchStamped"])
def test_half_a_message_of_a_body_is_refused(name):
    whole = packed(sensor_messages.Imu() if name == "sensor_msgs/Imu" else geometry_messages.WrenchStamped())
    with pytest.raises(PipeError, match=name):
        codec(name).decode(whole[:-1], "")


def test_further_interfaces_are_what_genpy_reads_and_writes():
    commands = codec("solfer/JointCommand")
    values = np.array([[1.0, 2.0, 3.0], [-4.0, 5.0, 6e9]])
    message = JointMessage(NAMES, stiffness=np.array([7.0, 8.0, 9.0]), interfaces=("bias", "größe"), values=values)
    read = JointCommand().deserialize(sent(commands.encode(message)))
    assert (tuple(read.name), tuple(read.interface)) == (NAMES, message.interfaces)
    assert (read.value, read.stiffness, read.position) == (tuple(values.ravel()), (7.0, 8.0, 9.0), ())
    for _ in range(2):
        decoded = commands.decode(packed(read), "sender")
        assert (decoded.names, decoded.interfaces, decoded.position) == (NAMES, message.interfaces, None)
        assert_array_equal(decoded.values, values)
    plain = commands.decode(packed(JointCommand(name=list(NAMES), position=[1.0, 2.0, 3.0])), "sender")
    assert (plain.interfaces, plain.values) == ((), None)
    with pytest.raises(PipeError, match="5 numbers in 'value' for 2 interfaces of 3 names"):
        commands.decode(packed(JointCommand(name=list(NAMES), interface=["a", "b"], value=[0.0] * 5)), "sender")


@pytest.mark.parametrize("lacks", list(itertools.product((False, True), repeat=3)), ids=str)
def test_an_imu_may_lack_each_quantity(lacks):
    """A covariance of -1 marks what a driver does not measure: it is NaN here, and marked again when it is sent."""
    imu, message = codec("sensor_msgs/Imu"), sensor_messages.Imu()
    message.orientation.w, message.angular_velocity.z, message.linear_acceleration.x = 1.0, 0.3, 9.0
    names = ("orientation", "angular_velocity", "linear_acceleration")
    for name, lacking in zip(names, lacks, strict=True):
        setattr(message, f"{name}_covariance", [-1.0 if lacking else 0.0] + 8 * [0.0])
    if lacks[0]:
        message.orientation.w = 0.0  # as drivers leave it
    read = imu.decode(packed(message), "driver")
    for numbers, lacking in zip((read.orientation, read.angular, read.acceleration), lacks, strict=True):
        assert np.isnan(numbers).all() if lacking else np.isfinite(numbers).all()
    again = sensor_messages.Imu().deserialize(sent(imu.encode(read)))
    for name, lacking in zip(names, lacks, strict=True):
        assert getattr(again, f"{name}_covariance")[0] == (-1.0 if lacking else 0.0)
        was, now = (getattr(each, name) for each in (message, again))
        assert now == (type(was)() if lacking else was)


@pytest.mark.parametrize("covariance", [0.0, 0.01])
def test_an_orientation_of_zeros_is_not_measured(covariance):
    message = sensor_messages.Imu()
    message.angular_velocity.z, message.orientation_covariance = 0.3, [covariance] * 9
    read = codec("sensor_msgs/Imu").decode(packed(message), "driver")
    assert np.isnan(read.orientation).all() and read.angular.tolist() == [0.0, 0.0, 0.3]


@pytest.mark.parametrize("length", [0.9955, 1.0045])
def test_an_orientation_gets_the_length_one(length, caplog):
    """Once for each sender the log has it, unless it is only rounded."""
    body, message = codec("nav_msgs/Odometry"), nav_messages.Odometry()
    for sender in ("rounded", "driver", "driver", "b"):
        message.pose.pose.orientation.w = 1.0 + (length - 1.0) * (0.01 if sender == "rounded" else 1.0)
        assert body.decode(packed(message), sender).orientation.tolist() == [0.0, 0.0, 0.0, 1.0]
    assert [text.split(" have")[0] for text in caplog.messages] == ["quaternions of driver", "quaternions of b"]
