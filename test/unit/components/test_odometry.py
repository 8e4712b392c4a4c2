"""The component `odometry` without any transport: golden poses, slip, lifted wheels, bias, starts and resets."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.robots import centauro, lower_body
from support.unit.golden import golden, rolling_legs

from solfer.components.odometry import Odometry
from solfer.components.odometry.kalman_kernel import TILT
from solfer.components.odometry.messages import SetBase, StampedUncertainPose, UncertainPose
from solfer.components.odometry.tags import OdometryTags
from solfer.errors import ComponentError, NotFinite
from solfer.interfaces.declaration import TopicOut
from solfer.interfaces.geometry import Header, Pose, Turn, Vector
from solfer.numerics.base_chart import rotation_of

RADIUS, RATE, SPEED = 0.078, 200.0, 0.3
STRAIGHT, SIDES = np.full(4, SPEED), np.array((1.0, -1.0, 1.0, -1.0))
AS_ORIGINAL = RATE * math.atan(0.5) / math.pi
"""The original's filters, which are not bent to their cut-off, have this one [Hz]."""


@pytest.fixture
def robot():
    return standing()


def standing():
    """Make a robot that stands and looks along 0.4 rad."""
    robot = lower_body()
    indices, values = robot.named_state("mammal_wide_straight")
    robot.state.position[indices] = values
    robot.state.position[5] = 0.4
    return robot


def component(robot, **tags):
    made = Odometry(robot, OdometryTags(**{"method": "filter"} | tags))
    made.set_rate(RATE)
    robot.update()
    made.init()
    return made


def drive(made, duration, speeds=STRAIGHT, heading=0.4, bias=0.0, move=None):
    """Let wheels roll with speeds over the ground [m/s], and the IMU measure a heading [rad] with a bias [rad/s]."""
    robot = made.model
    wheels = [robot.dof(f"j_wheel_{index}") for index in (1, 2, 3, 4)]
    for k in range(round(duration * RATE)):
        robot.state.position[wheels] += SIDES * speeds / RADIUS / RATE
        robot.state.velocity[wheels] = SIDES * speeds / RADIUS
        robot.state.position[3:6] = 0.0, 0.0, heading + bias * (k + 1) / RATE
        robot.state.velocity[3:6] = 0.0, 0.0, bias + 1e-9 * (k % 2)
        if move is not None:
            move(k)
        robot.update()
        made.update()
        made.send()


def way(made):
    return made.model.state.position[:2] @ (math.cos(0.4), math.sin(0.4))


@pytest.mark.slow
def test_geometric_pose_follows_the_original():
    """Poses that the C++ program recorded on rolling legs are the oracle, to 1e-9, in all six coordinates."""
    data, columns = golden("odometry")
    robot, rows = lower_body(), {round(row[0] * RATE): np.array(row) for row in data["rows"]}
    filters = {
        name: {"cut_off_frequency": AS_ORIGINAL, "damping": damping, "unit": "Hz"}
        for name, damping in (("filter", 1.0), ("velocity", 4.0))
    }
    made = Odometry(robot, OdometryTags(method="geometric", **filters))
    made.set_rate(RATE)
    robot.state.position[:], _ = rolling_legs(data["q0_posture"], 0.0)
    robot.update()
    made.init()  # at rest, as the original's filters begin
    for k in range(-1, 700):  # the first cycle counts twice there
        robot.state.position[:], robot.state.velocity[:] = rolling_legs(data["q0_posture"], max(k, 0) / RATE)
        robot.update()
        if k < 0:
            made.law.update(1.0 / RATE, True)
        else:
            made.update()
        if k in rows:
            expected, base = rows[k][columns["base_x"] : columns["base_rz"] + 1], robot.state.position[:6]
            place = expected[:3] - (0.0, 0.0, robot.kinematics.base.position[2])  # this one is above the world's origin
            np.testing.assert_allclose(base[:3], place, atol=1e-9)
            np.testing.assert_allclose(rotation_of(*base[3:]), rotation_of(*expected[3:]), atol=1e-9)


@pytest.mark.parametrize(("method", "share"), [("geometric", 1e-3), ("filter", 2e-3)])
def test_wheels_that_roll_carry_the_base(robot, method, share):
    made = component(robot, method=method)
    drive(made, 2.0)
    assert way(made) == pytest.approx(2.0 * SPEED, rel=share)
    speed = robot.state.velocity[:2] @ (math.cos(0.4), math.sin(0.4))
    assert speed == pytest.approx(SPEED, rel=1e-3)
    np.testing.assert_array_equal(robot.command.position[:6], robot.state.position[:6])


def test_the_start_does_not_jump(robot):
    made = component(robot)
    begun = robot.state.position[:6].copy()
    drive(made, 0.05, np.zeros(4))
    np.testing.assert_allclose(robot.state.position[:6], begun, atol=1e-12)
    assert begun[5] == pytest.approx(0.4) and not begun[:2].any()


@pytest.mark.parametrize("wheel", range(4))
def test_a_wheel_that_spins_is_not_believed(robot, wheel):
    speeds = np.full(4, SPEED)
    speeds[wheel] = 1.5
    made = component(robot)
    drive(made, 2.0, speeds)
    assert way(made) == pytest.approx(2.0 * SPEED, abs=0.02)
    inliers = np.ones(4, dtype=bool)
    inliers[wheel] = False
    np.testing.assert_array_equal(made.law.consensus.inliers, inliers)


def test_a_lifted_wheel_is_left_out(robot):
    made = component(robot)
    height, knee = robot.state.position[2], robot.dof("knee_pitch_1")

    def lift(k):
        robot.state.position[knee] += 0.002 * (1.0 if k < 100 else -1.0 if k < 200 else 0.0)

    drive(made, 0.45, np.zeros(4), move=lift)
    assert made.law.lifted.tolist() == [True, False, False, False] and way(made) == pytest.approx(0.0, abs=0.01)
    drive(made, 0.6, np.zeros(4), move=lambda k: lift(k + 90))
    assert not made.law.lifted.any() and robot.state.position[2] == pytest.approx(height, abs=0.005)


@pytest.mark.parametrize("speed", [0.0, SPEED], ids=["hangs", "rolls"])
def test_a_wheel_that_has_stepped_up_counts_again_as_it_rolls(robot, speed):
    """One that hangs in the air does not roll as the base drives."""
    made, knee = component(robot), robot.dof("knee_pitch_1")

    def lift(_):
        robot.state.position[knee] += 0.002

    drive(made, 0.5, np.zeros(4), move=lift)
    assert made.law.lifted[0]
    drive(made, 0.25, np.array((speed, SPEED, SPEED, SPEED)))
    assert made.law.lifted.tolist() == [speed == 0.0, False, False, False]


def test_a_lifted_wheel_stays_lifted_while_swaying(robot):
    made, knee, phases = component(robot), robot.dof("knee_pitch_1"), ((1, -1), (-1, 0), (0, 1))

    def sway(k):
        # its leg and the base move it to and fro, by the same way in all and never together
        lower, pitch = phases[k % 3]
        robot.state.position[knee] += 0.002 if k < 100 else 0.004 * lower
        robot.state.position[4] = 0.012 * (k >= 100 and pitch < 0)

    drive(made, 2.0, np.zeros(4), move=sway)
    assert made.law.lifted.tolist() == [True, False, False, False]


@pytest.mark.slow
def test_wheels_that_climb_are_not_lifted(robot):
    made, steepest, base = component(robot), math.radians(10.0), 1.092
    cycles = round(base / SPEED * RATE)

    def climb(k):
        # the front wheels are on the slope, the others not yet; joints stand still but for the wheels
        pitch = -steepest * min(1.0, k / cycles)
        turn = Rotation.from_euler("z", 0.4) * Rotation.from_euler("y", pitch)
        robot.state.position[3:6] = turn.as_euler("XYZ")
        robot.state.velocity[3:6] = 1e-9 * (k % 2)
        assert not made.law.lifted.any()

    drive(made, base / SPEED + 1.0, move=climb)
    risen = made.law.position[2] + made.law._motion.mean_height()
    assert risen == pytest.approx((0.5 * base + SPEED) * math.sin(steepest), abs=0.025)


def tilt(made, duration, rate, speed=0.0, carries=(True, True, True, True), largest=math.inf):
    """Let the base and its ground pitch [rad/s], where some wheels carry 250 N; return when that contradicts [s]."""
    robot, contradicted = made.model, []

    def pitch(k):
        turn = Rotation.from_euler("z", 0.4) * Rotation.from_euler("y", -min(rate * (k + 1) / RATE, largest))
        robot.state.position[3:6] = turn.as_euler("XYZ")
        robot.state.velocity[3:6] = 1e-9 * (k % 2)
        robot.state.torque[6:] = -250.0 * np.array(carries) @ made.law._motion.wheels.jacobian[2::3]
        if made.law.ground.turns:
            contradicted.append(k / RATE)

    drive(made, duration, np.full(4, speed), move=pitch)
    return contradicted[0] if contradicted else None


@pytest.mark.parametrize("speed", [0.02, 0.15])
def test_the_ground_does_not_turn_below_a_robot(robot, speed):
    """An IMU turns on its link, and all that it measures agrees: the wheels that carry the robot are the witness."""
    assert tilt(component(robot), 1.5, 0.2, speed) < 1.0


@pytest.mark.parametrize("speed", [0.15, 0.6, 2.0])
def test_the_ground_turns_below_a_robot_that_drives_onto_a_ramp(robot, speed):
    base, steepest = 1.092, math.radians(15.0)
    assert tilt(component(robot), base / speed + 0.5, steepest * speed / base, speed, largest=steepest) is None


def test_others_are_told_of_the_ground(robot):
    """Level, then on a ramp of 15 degrees: places are those of the wheels' contacts, normals those of the ramp."""
    made = component(robot)
    report = next(topic for topic in made.topics() if topic.name == "ground").collect
    drive(made, 0.5, np.zeros(4))
    level = report()
    assert level.normal == Vector(z=1.0) and level.header.frame_id == "odom"
    speed = 0.6
    tilt(made, 3.0, math.radians(15.0) * speed / 1.092, speed, largest=math.radians(15.0))
    ramp = report()
    slope = Rotation.from_euler("z", made.law.heading) * Rotation.from_euler("y", -math.radians(15.0))
    for normal in (*ramp.normals, ramp.normal):
        assert (normal.x, normal.y, normal.z) == pytest.approx(slope.as_matrix()[:, 2], abs=0.015)
    contacts = robot.twin().contacts
    assert ramp.names == tuple(contacts.names[:4]) and all(map(math.isnan, ramp.friction))
    places = np.array([(each.x, each.y, each.z) for each in ramp.places])
    assert np.abs((places - places.mean(axis=0)) @ slope.as_matrix()[:, 2]).max() < 0.02
    assert 0.0 < ramp.normal_deviations[0] < 0.02 and 0.0 <= ramp.height_deviations[0] < 0.1


@pytest.mark.parametrize("rate", [0.2, 2.0])
@pytest.mark.parametrize("wheels", [(), (0,), (0, 1), (0, 1, 2, 3)])
def test_a_robot_that_tips_lifts_wheels(robot, wheels, rate):
    """It turns as a whole on the others, at first as slowly as a wrong IMU; then it falls."""
    carries = [wheel not in wheels for wheel in range(4)]
    assert tilt(component(robot), 0.8, rate, 0.02, carries) is None or not wheels and rate < 0.5


def test_a_robot_that_is_pushed_with_a_wheel_lifted_may_turn(robot):
    made, knee = component(robot), robot.dof("knee_pitch_1")

    def lift(k):
        robot.state.position[knee] += 0.002 * (k < 100)

    drive(made, 0.6, np.zeros(4), move=lift)
    assert made.law.lifted[0] and tilt(made, 0.8, 0.2, 0.02) is None


def test_the_bias_is_learned_at_rest(robot):
    made = component(robot)
    drive(made, 2.0, np.zeros(4), bias=0.003)
    assert made.law.kalman.bias == pytest.approx(0.003, rel=0.02)
    assert robot.state.position[5] == pytest.approx(0.4, abs=1e-3)


def test_a_gap_in_the_joints_is_bridged(robot):
    made = component(robot)
    drive(made, 0.5)
    joints, way_then = robot.state.position[6:].copy(), way(made)
    wheels = [robot.dof(f"j_wheel_{index}") - 6 for index in (1, 2, 3, 4)]
    turned = joints.copy()

    def keep(k):
        turned[wheels] += SIDES * SPEED / RADIUS / RATE
        robot.state.position[6:] = turned if k == 99 else joints

    drive(made, 0.5, move=keep)
    assert way(made) - way_then == pytest.approx(0.5 * SPEED, abs=0.003)
    drive(made, 0.5)
    assert way(made) - way_then == pytest.approx(SPEED, abs=0.005)


@pytest.mark.slow
def test_covariance_grows_without_the_imu():
    """The heading's variance must show users of the topic that nothing measures the turn any more."""
    grown = []
    for silent in (False, True):
        robot = standing()
        made = component(robot)
        drive(made, 1.0, np.zeros(4))
        made.law.kalman.place()

        def keep(_, silent=silent, robot=robot):
            if silent:  # the State has what the component has written
                robot.state.position[3:6] = robot.command.position[3:6]
                robot.state.velocity[3:6] = robot.command.velocity[3:6]

        drive(made, 0.5, move=keep)
        grown.append(made.law.kalman.covariance[3, 3])
        assert way(made) == pytest.approx(0.5 * SPEED, rel=0.02)
        published = made.uncertain_pose()
        assert published.pose.covariance[35] == grown[-1] and published.header.frame_id == "odom"
        assert published.pose.pose.position.x == made.law.position[0]
    assert grown[1] > 4.0 * grown[0] > 0.0


def test_covariances_of_pose_and_twist_stand_in_the_desired_state(robot):
    """Other plugins read them there: symmetric, not negative, and the twist in the axes of a tilted base."""
    made, angles = component(robot), (0.2, -0.3)

    def tilt(k):
        robot.state.position[3:5] = np.array(angles) * min(1.0, (k + 1) / 100)
        robot.state.velocity[3:5] = np.array(angles) * RATE / 100 * (k < 100)

    drive(made, 1.0, move=tilt)
    pose, twist = (robot.command[name].reshape(6, 6) for name in ("pose_covariance", "twist_covariance"))
    in_world, axes = np.zeros((2, 6, 6))
    made.law.write_covariance(in_world, axes)
    np.testing.assert_array_equal(pose, in_world)
    to_world = Rotation.from_euler("XYZ", robot.state.position[3:6])  # turns about x, then y, then z of the base
    turn = np.kron(np.eye(2), (Rotation.from_euler("z", -made.law.heading) * to_world).as_matrix())
    np.testing.assert_allclose(twist, turn.T @ axes @ turn, atol=1e-15)
    for each in (pose, twist):
        np.testing.assert_allclose(each, each.T, atol=1e-15)
        assert np.linalg.eigvalsh(each).min() > -1e-15 and (np.diag(each) > 0.0).all()
    np.testing.assert_array_equal(made.uncertain_pose().pose.covariance, pose.ravel())


def test_covariances_are_those_of_the_errors(robot):
    made = component(robot)
    drive(made, 0.5)
    law = made.law
    errors, pose, twist = law.kalman.covariance, *np.zeros((2, 6, 6))
    law.write_covariance(pose, twist)
    # position and heading, and turns about the world's axes: minus the tilt, about those of the heading
    turn = Rotation.from_euler("z", law.heading).as_matrix()[:2, :2]
    made_of = np.zeros((6, len(errors)))
    made_of[[0, 1, 2, 5], range(4)] = 1.0
    made_of[3:5, TILT : TILT + 2] = -turn
    np.testing.assert_allclose(pose, made_of @ errors @ made_of.T, atol=1e-16)
    assert np.abs(pose[3:5, 5]).max() > 0.0 or np.abs(pose[3:5, :2]).max() > 0.0
    np.testing.assert_allclose(twist[:3, :3] - errors[4:7, 4:7], (twist[:3, :3] - errors[4:7, 4:7]).T, atol=1e-16)


def test_other_methods_know_no_covariance(robot):
    component(robot, method="geometric")
    assert "pose_covariance" not in robot.command


def test_a_request_puts_the_base_elsewhere(robot):
    made = component(robot)
    made.set_base(SetBase(3.0, -2.0, 1.4))
    drive(made, 0.02, np.zeros(4))
    np.testing.assert_allclose(robot.state.position[[0, 1, 5]], (3.0, -2.0, 1.4), atol=1e-6)
    with pytest.raises(NotFinite):
        made.set_base(SetBase(math.nan, 0.0, 0.0))


def test_a_robot_without_wheels_is_refused(robot):
    with pytest.raises(ComponentError, match="0 wheels or feet in 'base'"):
        Odometry(robot, OdometryTags(chain="base"))


def test_hands_do_not_count_beside_wheels():
    """CENTAURO's have contacts of the type that feet have."""
    robot = centauro()
    assert {"left_arm", "right_arm"} <= {each.name for each in robot.contact_records}
    made = Odometry(robot, OdometryTags(chain="all", method="filter"))
    assert made.law.feet is None and len(made.law.lifted) == 4


def pose_at(x=3.0, y=-2.0, yaw=1.4, frame="odom", variance=0.04):
    covariance = np.diag((variance, variance, 0.0, 0.0, 0.0, 0.01)).ravel()
    turn = Turn(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
    return StampedUncertainPose(
        Header(frame_id=frame), UncertainPose(Pose(Vector(x, y, 9.0), turn), tuple(covariance.tolist()))
    )


def test_a_pose_puts_the_base_with_its_covariance(robot):
    made = component(robot)
    made.set_pose(pose_at())
    drive(made, 0.02, np.zeros(4))
    np.testing.assert_allclose(robot.state.position[[0, 1, 5]], (3.0, -2.0, 1.4), atol=1e-5)
    np.testing.assert_allclose(np.diag(made.law.kalman.covariance)[[0, 1, 3]], (0.04, 0.04, 0.01), rtol=0.01)


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ({"x": math.nan}, "a pose at"),
        ({"yaw": math.nan}, "quaternion"),
        ({"frame": "map"}, "frame 'map'"),
        ({"variance": -1.0}, "variance of -1"),
    ],
)
def test_a_wrong_pose_is_refused(robot, wrong, what):
    made = component(robot)
    before = made.law.position.copy()
    with pytest.raises((NotFinite, ComponentError), match=what):
        made.set_pose(pose_at(**wrong))
    np.testing.assert_array_equal(made.law.position, before)


def published(made, name):
    return [topic for topic in made.topics() if isinstance(topic, TopicOut) and topic.name == name]


def test_the_base_is_a_transform_where_it_is_configured(robot):
    assert not published(component(standing()), "/tf")
    made = component(robot, transform=True)
    drive(made, 0.5)
    (placed,) = published(made, "/tf")[0].collect().transforms
    assert (placed.header.frame_id, placed.child_frame_id) == ("odom", robot.kinematics.base_link)
    place, turn = placed.transform.translation, placed.transform.rotation
    np.testing.assert_array_equal((place.x, place.y, place.z), made.law.position)
    assert 2.0 * math.atan2(turn.z, turn.w) == pytest.approx(0.4, abs=1e-6)


def test_diagnostics_tell_what_each_wheel_does(robot):
    """One wheel turns faster than the ground passes: the report names it as slipping and the others as rolling."""
    made = component(robot)
    speeds = np.full(4, SPEED)
    speeds[2] = 1.5
    drive(made, 1.0, speeds)
    (topic,) = published(made, "/diagnostics")
    assert topic.rate == 1.0
    (status,) = topic.collect().status
    assert status.level == 1 and [entry.value.partition(",")[0] for entry in status.values] == [
        "rolls",
        "rolls",
        "slips",
        "rolls",
    ]
    assert float(status.values[2].value.split()[-1]) <= 0.5 < float(status.values[0].value.split()[-1])


def test_the_imu_comes_back_without_a_jump(robot):
    made, steps, before = component(robot), [], np.zeros(3)
    drive(made, 0.5)

    def keep(k):
        steps.append(float(np.linalg.norm(made.law.position - before)))
        before[:] = made.law.position
        if k < 100:  # half a second in which the State has what the component has written
            robot.state.position[3:6] = robot.command.position[3:6]
            robot.state.velocity[3:6] = robot.command.velocity[3:6]

    drive(made, 1.0, move=keep)
    assert max(steps[2:]) < 1.5 * SPEED / RATE
    assert robot.state.position[5] == pytest.approx(0.4, abs=1e-3)


def test_the_base_does_not_go_on_tilting_without_the_imu(robot):
    """A rate that was refused soon after it was wrong would move the base by its height above the wheels, on and on."""
    made, tilts = component(robot), []
    drive(made, 0.5)

    def tilt_on(k):
        tilts.append(float(np.abs(made.law.angular[:2]).max()))
        if k < 5:
            robot.state.position[3:6] = Rotation.from_euler("ZY", (0.4, 0.5 * (k + 1) / RATE)).as_euler("XYZ")
            robot.state.velocity[3:6] = 0.0, 0.5, 1e-9 * (k % 2)
        else:
            robot.state.position[3:6] = robot.command.position[3:6]
            robot.state.velocity[3:6] = robot.command.velocity[3:6]

    drive(made, 0.2, move=tilt_on)
    assert max(tilts) > 0.2
    assert tilts[-1] < 0.01
    assert abs(float(np.linalg.norm(made.law.velocity)) - SPEED) < 0.01


def test_a_new_start_forgets_what_was_learned(robot):
    made = component(robot)
    drive(made, 1.0, bias=0.003)
    robot.state.position[3:6], robot.state.velocity[:6] = (0.0, 0.0, 0.4), 0.0
    robot.update()
    made.init()
    other = standing()
    other.state.position[:], other.state.velocity[:] = robot.state.position, robot.state.velocity
    fresh = component(other)
    np.testing.assert_array_equal(made.law.kalman.covariance, fresh.law.kalman.covariance)
    np.testing.assert_allclose(robot.state.position[[0, 1]], 0.0, atol=1e-12)
    assert made.law.kalman.bias == 0.0


def test_the_method_of_an_earlier_release_is_the_filter(caplog):
    """A file is read more than once, and says so once."""
    made = [OdometryTags(method="rolling") for _ in range(2)]
    assert [tags.method for tags in made] == ["filter", "filter"]
    assert caplog.text.count("`method: filter` takes its place") == 1


def test_a_prefix_distinguishes_the_frames_of_two_robots(robot):
    made = component(robot, transform=True)
    (parameter,) = made.parameters()
    parameter.handler("/red/")
    (placed,) = published(made, "/tf")[0].collect().transforms
    assert parameter.name == "/tf_prefix" and placed.child_frame_id == f"red/{robot.kinematics.base_link}"
    assert placed.header.frame_id == "odom"
