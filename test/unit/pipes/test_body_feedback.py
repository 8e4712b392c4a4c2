"""Operational-space feedback: any link, sensor and convention measure the same floating base, against SciPy."""

import logging
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation
from support.unit.body_feedback import DESCRIPTION, DESCRIPTION_DOFS, Q, V, make, truth
from support.unit.joint_pipes import FILTER, RATE, low_passed, make_robot

from solfer.config.kinds.table import record_of
from solfer.config.records.pipes import FeedbackRecord
from solfer.config.records.record import read
from solfer.errors import PipeError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Kinematics, State
from solfer.numerics.filters import LowPass
from solfer.pipes import PipeContext, factory
from solfer.pipes.body.sensor_mount import SensorMount
from solfer.transport import BodyMessage, ImuMessage, MessageStatus
from solfer.transport.messages import VectorMessage

OFFSET, TURN = np.array((0.05, -0.02, 0.07)), Rotation.from_euler("XYZ", (2.0, -0.6, 1.2))


@pytest.mark.parametrize("link", ["base", "arm", "wheel", "sensor"])
@pytest.mark.parametrize("mounted", [False, True])
def test_any_link_measures_the_base(link, mounted):
    offset, turn = (OFFSET, TURN) if mounted else (None, None)
    position, rotation, linear, angular = truth(link, offset, turn)
    pipe, reader, state = make("nav_msgs/Odometry", link, offset=offset, turn=turn)
    reader.publish(BodyMessage("world", link, position, rotation.as_quat(), linear, angular))
    assert pipe.run() is MessageStatus.NEW
    assert_allclose(state.position, Q, atol=1e-12)
    assert_allclose(state.velocity, V, atol=1e-12)


@pytest.mark.parametrize("order", ["xyzw", "wxyz"])
@pytest.mark.parametrize("kind", ["HAMILTONIAN", "JPL"])
@pytest.mark.parametrize("frame", ["body", "world"])
def test_odometry_in_every_convention(order, kind, frame):
    """SciPy's rotations encode one truth eight ways; the wrong convention must give a visibly different base."""
    position, rotation, linear, angular = truth("arm")
    given = (rotation if kind == "HAMILTONIAN" else rotation.inv()).as_quat(scalar_first=order == "wxyz")
    # a codec trusts the orientation, and turns the twist of the wire by it
    wire = [rotation.inv().apply(vector) if frame == "body" else vector for vector in (linear, angular)]
    believed = Rotation.from_quat(given)
    message = BodyMessage("world", "arm", position, given, *(believed.apply(vector) for vector in wire))
    tags = {"orientation": {"order": order, "convention": kind}, "twist": {"frame": frame}}
    pipe, reader, state = make("nav_msgs/Odometry", "arm", **tags)
    reader.publish(message)
    pipe.run()
    assert_allclose(state.position, Q, atol=1e-12)
    assert_allclose(state.velocity, V, atol=1e-12)
    # the same message under another convention is another base
    other = {"orientation": {"order": order, "convention": "JPL" if kind == "HAMILTONIAN" else "HAMILTONIAN"}}
    pipe, reader, state = make("nav_msgs/Odometry", "arm", **other)
    reader.publish(message)
    pipe.run()
    assert np.abs(state.position - Q).max() > 0.1


@pytest.mark.parametrize("kind", [np.asarray, np.float32, np.ndarray.tolist])
def test_an_imu_measures_orientation_and_its_rates_only(kind):
    _, rotation, _, angular = truth("sensor", OFFSET, TURN)
    pipe, reader, state = make("sensor_msgs/Imu", "sensor", offset=OFFSET, turn=TURN, position={"type": "NONE"})
    state.position[:3], state.velocity[:3] = (7.0, 8.0, 9.0), (1.0, 2.0, 3.0)
    reader.publish(ImuMessage("sensor", kind(rotation.as_quat()), kind(rotation.inv().apply(angular))))
    pipe.run()
    assert_allclose(state.position[3:6], Q[3:6], atol=1e-12 if kind is not np.float32 else 1e-6)
    assert_allclose(state.velocity[3:6], V[3:6], atol=1e-12 if kind is not np.float32 else 1e-6)
    assert_allclose(state.position[:3], (7.0, 8.0, 9.0), atol=0.0)
    assert_allclose(state.velocity[:3], (1.0, 2.0, 3.0), atol=0.0)


@pytest.mark.parametrize("frame", ["world", "body"])
def test_pose_and_twist_in_separate_messages(frame):
    position, rotation, linear, angular = truth("sensor")
    pose, reader, state = make("geometry_msgs/PoseStamped", "sensor", ("position",))
    reader.publish(VectorMessage("world", np.concatenate((position, rotation.as_quat()))))
    pose.run()
    assert_allclose(state.position, Q, atol=1e-12)
    assert not state.velocity[:6].any()
    turn = rotation.inv() if frame == "body" else Rotation.identity()
    twist, reader, other = make("geometry_msgs/TwistStamped", "sensor", ("velocity",))
    other.position[:] = state.position
    values = np.concatenate((turn.apply(linear), turn.apply(angular)))
    reader.publish(VectorMessage("sensor" if frame == "body" else "odom", values))
    twist.run()
    assert_allclose(other.velocity, V, atol=1e-12)
    assert_allclose(other.position, Q, atol=1e-12)


@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_angles_are_turns_in_the_given_order(axes):
    _, rotation, _, _ = truth("base")
    angles = np.empty(3)
    angles[list(axes)] = rotation.as_euler("".join("XYZ"[axis] for axis in axes))
    pipe, reader, state = make(
        "geometry_msgs/Vector3Stamped",
        "base",
        ("position",),
        axes=axes,
        position={"type": "NONE"},
        orientation={"type": "EULER"},
    )
    reader.publish(VectorMessage("imu", angles))
    pipe.run()
    assert_allclose(state.position[3:6], Q[3:6], atol=1e-12)


def test_angles_go_on_past_pi():
    pipe, reader, state = make("geometry_msgs/QuaternionStamped", "base", ("position",), position={"type": "NONE"})
    chart, seen = Kinematics(DESCRIPTION).base, []
    for angle in np.linspace(0.0, 9.0, 40):
        quaternion = chart.to_pose(np.array((0.0, 0.0, 0.0, 0.1, 0.2, angle)))[1]
        reader.publish(VectorMessage("world", quaternion))
        pipe.run()
        seen.append(state.position[5])
    assert_allclose(seen, np.linspace(0.0, 9.0, 40), atol=1e-9)


def test_a_filter_continues_angles_past_pi():
    pipe, reader, state = make(
        "nav_msgs/Odometry",
        "base",
        ("position",),
        low_pass=lambda size: LowPass(size, FILTER["frequency"], FILTER["damping"], RATE),
    )
    angles, seen, chart = np.linspace(2.9, 3.5, 25), [], Kinematics(DESCRIPTION).base
    for angle in angles:
        reader.publish(BodyMessage("world", "base", *chart.to_pose(np.array((0.0, 0.0, 0.0, angle, 0.2, 0.3)))))
        pipe.run()
        seen.append(state.position[3])
    assert_allclose(seen, low_passed(angles, **FILTER), atol=1e-12)
    assert_allclose(state.position[4:6], (0.2, 0.3), atol=1e-12)


@pytest.mark.parametrize(
    "message, match",
    [
        (BodyMessage("world", "arm"), "describes 'arm'"),
        (BodyMessage("world", "base", np.array((math.nan, 0.0, 0.0))), "not a finite number"),
        (BodyMessage("world", "base", linear=np.array((0.0, math.inf, 0.0))), "not a finite number"),
        (BodyMessage("world", "base", orientation=np.array((0.0, 0.0, 0.0, 1.1))), "norm 1.1"),
        (BodyMessage("world", "base", orientation=np.full(4, math.nan)), "norm nan"),
    ],
)
def test_an_unfit_message_is_refused_whole(message, match, caplog):
    pipe, reader, state = make("nav_msgs/Odometry", "base")
    before = state.position.copy(), state.velocity.copy()
    reader.publish(message)
    with caplog.at_level(logging.WARNING):
        assert pipe.run() is MessageStatus.OLD
    assert match in caplog.text and (pipe.accepted, pipe.refused) == (0, 1)
    assert_allclose(state.position, before[0], atol=0.0)
    assert_allclose(state.velocity, before[1], atol=0.0)
    reader.publish(BodyMessage("world", "base", np.array((1.0, 2.0, 3.0))))
    assert pipe.run() is MessageStatus.NEW


@pytest.mark.parametrize(
    "wrong, match",
    [
        ({"orientation": np.zeros(4)}, "the sensor measures no orientation"),
        ({"orientation": np.array((0.0, 0.0, 0.0, math.nan))}, "norm nan"),
        ({"orientation": np.full(4, math.nan)}, "the sensor measures no orientation"),
        ({"angular": np.full(3, math.nan)}, "the sensor measures no angular velocity"),
        ({"angular": np.array((0.0, math.nan, 0.0))}, "not a finite number"),
    ],
)
def test_what_an_imu_tells_wrongly_is_held_and_named_once(wrong, match, caplog):
    pipe, reader, state = make("sensor_msgs/Imu", "base", position={"type": "NONE"})
    turn = Rotation.from_euler("XYZ", (0.1, -0.2, 0.3)).as_quat()
    reader.publish(ImuMessage("base", turn, np.array((0.1, 0.2, 0.3))))
    assert pipe.run() is MessageStatus.NEW
    held = state.position.copy(), state.velocity.copy()
    with caplog.at_level(logging.WARNING):
        for _ in range(5):
            reader.publish(ImuMessage("base", **{"orientation": turn} | wrong))
            assert pipe.run() is MessageStatus.OLD
    assert caplog.text.count(match) == 1 and (pipe.accepted, pipe.refused) == (1, 5)
    assert_array_equal(state.position, held[0])
    assert_array_equal(state.velocity, held[1])


def test_a_steep_base_is_warned_about(caplog):
    pipe, reader, _ = make("nav_msgs/Odometry", "base", ("position",))
    chart = Kinematics(DESCRIPTION).base
    for tilt, steep in ((74.4, False), (75.6, True)):
        caplog.clear()
        position, quaternion = chart.to_pose(np.array((0.0, 0.0, 0.0, 0.1, math.radians(tilt), 0.2)))
        reader.publish(BodyMessage("world", "base", position, quaternion))
        pipe.run()
        assert ("tilted by ry = 76 deg" in caplog.text) is steep


def test_links_that_cannot_measure_the_base():
    with pytest.raises(UnknownName, match="unknown link 'arms'"):
        SensorMount(DESCRIPTION, "arms", State(DESCRIPTION_DOFS))
    with pytest.raises(PipeError, match="does not carry the link 'world'"):
        SensorMount(DESCRIPTION, "world", State(DESCRIPTION_DOFS))


@pytest.mark.parametrize(
    "link, extra, key",
    [("base", "layer: online\nsensor: world\n", "sensor"), ("world", "", "name")],
    ids=["sensor", "link"],
)
def test_a_link_that_cannot_measure_is_refused(tmp_path, link, extra, key):
    """The world does not move with the base: the error points to the line of the tag that names it."""
    file = tmp_path / "pipe.yaml"
    file.write_text(f"""name: pelvis
space: OPERATIONAL
source: base
message: nav_msgs::Odometry
interface: {{position: true, velocity: true}}
dofs:
  name: {link}
  mapping: RBDL
  chain: all
  type: body
{extra}""")
    record = read(file, record_of(FeedbackRecord, "OPERATIONAL"))
    with pytest.raises(PipeError, match="does not carry the link .world") as caught:
        factory.feedback(record, PipeContext(make_robot(), MemoryMiddleware(Bus(), "node"), {}, RATE))
    line = next(number for number, text in enumerate(file.read_text().splitlines(), 1) if f"{key}: world" in text)
    assert caught.value.where.startswith(f"{file}:{line}:") and caught.value.where.endswith(key)


@pytest.mark.parametrize("link", ["base", "sensor"])
@pytest.mark.parametrize("frame", ["body", "world"])
def test_the_first_message_aligns_the_senders_world(link, frame):
    """The sender's world is turned and shifted: only motion since the first message counts, until a restart."""
    pipe, reader, state = make("nav_msgs/Odometry", link, calibrated=True, twist={"frame": frame})
    state.position[:6] = Q[:6]
    world, origin = Rotation.from_euler("z", 0.7), np.array((1.0, -2.0, 3.0))
    position, rotation, linear, angular = truth(link)

    def publish(position):
        turned = world * rotation
        wire = [vector if frame == "world" else turned.inv().apply(vector) for vector in world.apply([linear, angular])]
        # as above, a codec reads the twist on the wire as one in the axes of the body
        twist = (turned.apply(vector) for vector in wire)
        reader.publish(BodyMessage("map", link, origin + world.apply(position), turned.as_quat(), *twist))

    publish(position)
    assert pipe.run() is MessageStatus.NEW
    assert_allclose(state.position, Q, atol=1e-12)
    assert_allclose(state.velocity, V, atol=1e-12)
    # a later message shows the movement since the first
    state.position[:6] = 0.0
    publish(position + (0.2, 0.1, 0.0))
    pipe.run()
    assert_allclose(
        Kinematics(DESCRIPTION).base.to_pose(state.position)[0],
        Kinematics(DESCRIPTION).base.to_pose(Q)[0] + (0.2, 0.1, 0.0),
        atol=1e-12,
    )
    # after a new start it is aligned anew
    pipe.restart()
    state.position[:6] = Q[:6]
    publish(position - (5.0, 0.0, 0.0))
    pipe.run()
    assert_allclose(state.position, Q, atol=1e-12)


def test_an_imu_is_calibrated_in_its_heading_only():
    pipe, reader, state = make("sensor_msgs/Imu", "base", ("position",), calibrated=True, position={"type": "NONE"})
    state.position[5] = 0.4
    tilted = Rotation.from_euler("XYZ", (0.1, -0.2, 0.0))
    reader.publish(ImuMessage("base", (Rotation.from_euler("z", 2.0) * tilted).as_quat(), np.zeros(3), np.zeros(3)))
    pipe.run()
    chart = Kinematics(DESCRIPTION).base
    turned = Rotation.from_matrix(chart.to_rotation(state.position))
    up = np.array((0.0, 0.0, 1.0))
    assert_allclose(turned.inv().apply(up), tilted.inv().apply(up), atol=1e-12)  # the tilt is measured
    assert_allclose(state.position[:3], 0.0)


@pytest.mark.parametrize("force", [(math.nan, math.nan, math.nan), (0.0, 0.0, 9.81)])
def test_an_imu_without_an_accelerometer_counts(force):
    pipe, reader, state = make("sensor_msgs/Imu", "base", position={"type": "NONE"})
    headings = []
    for step in range(50):
        turn = Rotation.from_rotvec((0.0, 0.0, 0.001 * step))
        reader.publish(ImuMessage("base", turn.as_quat(), np.array((0.0, 0.0, 0.2)), np.array(force)))
        assert pipe.run() is MessageStatus.NEW
        headings.append(state.position[5])
    assert np.ptp(headings) == pytest.approx(0.049) and state.velocity[5] == pytest.approx(0.2)
    assert np.isfinite(state.defaults).all()


@pytest.mark.parametrize("link, turn", [("base", None), ("sensor", TURN)])
def test_a_sensor_without_an_orientation_measures_rates_alone(link, turn):
    """The base's own angles, which another pipe measures, say where the sensor's axes are."""
    _, rotation, _, angular = truth(link, turn=turn)
    pipe, reader, state = make("sensor_msgs/Imu", link, ("velocity",), turn=turn, position={"type": "NONE"})
    state.position[:] = Q
    reader.publish(ImuMessage(link, np.full(4, math.nan), rotation.inv().apply(angular)))
    assert pipe.run() is MessageStatus.NEW
    assert_allclose(state.velocity[3:6], V[3:6], atol=1e-12)
    assert_array_equal(state.position, Q)


@pytest.mark.parametrize("link, turn", [("base", None), ("sensor", TURN)])
def test_a_sensor_without_rates_measures_an_orientation_alone(link, turn):
    _, rotation, _, _ = truth(link, turn=turn)
    pipe, reader, state = make("sensor_msgs/Imu", link, ("position",), turn=turn, position={"type": "NONE"})
    reader.publish(ImuMessage(link, rotation.as_quat(), np.full(3, math.nan), np.full(3, math.nan)))
    assert pipe.run() is MessageStatus.NEW
    assert_allclose(state.position[3:6], Q[3:6], atol=1e-12)
    assert not state.velocity[:6].any()


@pytest.mark.parametrize("length", [0.9955, 1.0045])
@pytest.mark.parametrize("message", ["nav_msgs/Odometry", "sensor_msgs/Imu"])
def test_an_orientation_of_almost_the_length_one_is_made_one(message, length, caplog):
    """Within what tf2 allows: the messages of many drivers are rounded. The log has it once."""
    turn = Rotation.from_euler("XYZ", (0.1, -0.2, 0.3)).as_quat()
    states = []
    for factor in (length, 1.0):
        pipe, reader, state = make(message, "base", position={"type": "FULL" if message[0] == "n" else "NONE"})
        sent = factor * turn
        for _ in range(2):
            reader.publish(
                BodyMessage("world", "/base", orientation=sent) if message[0] == "n" else ImuMessage("/base", sent)
            )
            assert pipe.run() is MessageStatus.NEW and np.array_equal(sent, factor * turn)
        states.append(state.position.copy())
    assert_allclose(*states, atol=1e-12)
    assert caplog.text.count("have not quite the length 1") == 1
