"""Methods that `benchmark/estimation.py` compares, and its measurements, against closed formulas."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.estimation import part

from solfer.transport.messages import ImuMessage, JointMessage

baseline, rolling_squares, point_contacts = (
    part(f"estimation_cases.{name}") for name in ("baseline", "rolling_squares", "point_contacts")
)
log, measurements = part("estimation_cases.log"), part("estimation_cases.measurements")
CONTACTS = log.ROBOT / "contacts.yaml"
PLACES = np.array(((0.5, 0.3), (0.5, -0.3), (-0.5, 0.3), (-0.5, -0.3)))


def body(velocity, angular):
    """Make wheels whose joints measure a velocity of the base, and a turn about each axis."""
    arms = np.hstack((PLACES, np.full((4, 1), -0.6)))
    measured = -(velocity + np.cross(angular, arms)).ravel()
    return SimpleNamespace(arms=arms, jacobian=np.diag(measured), velocity=np.ones(12), touching=np.ones(4, dtype=bool))


def test_wheels_that_agree_tell_the_twist():
    velocity, angular = np.array((0.3, -0.1, 0.02)), np.array((0.05, -0.02, 0.4))
    made = body(velocity, angular)
    made.touching[1] = False
    np.testing.assert_allclose(np.concatenate(rolling_squares.twist(made, angular)), (*velocity, *angular), atol=1e-12)


def test_the_turn_is_weighted_by_arms():
    by_wheels, measured = 0.4, 0.1
    _, angular = rolling_squares.twist(
        body(np.zeros(3), np.array((0.0, 0.0, by_wheels))), np.array((0.0, 0.0, measured))
    )
    spread = float(np.sum(PLACES**2))  # squared distances from the mean of the wheels
    assert angular[2] == pytest.approx((measured + spread * by_wheels) / (1.0 + spread), rel=1e-12)


def still(force=9.81):
    """Return what CENTAURO measures that stands upright, with a specific force [m/s^2]."""
    robot = baseline.WheeledBody(CONTACTS)._robot
    names = robot.dofs[6:]
    joints = JointMessage(names, position=np.zeros(len(names)), velocity=np.zeros(len(names)))
    return SimpleNamespace(joints=joints, imu=ImuMessage("imu_link", acceleration=np.array((0.0, 0.0, force))))


def test_the_imu_is_integrated_exactly():
    """At constant rate and force the integrals have a closed form, which a hundred steps must match to 1e-11."""
    made = point_contacts.PointContacts(CONTACTS, still())
    rate, force, begun = np.array((0.3, -0.2, 0.5)), np.array((1.0, 2.0, -3.0)), made.rotation.copy()
    made.vectors[0] = velocity = np.array((0.4, -0.1, 0.2))
    place, duration, count = made.vectors[1].copy(), 0.5, 100
    for _ in range(count):
        made.propagate(rate, force, duration / count)
    # in the axes of the IMU all is constant: integrals of rotations about one axis
    angle, axis = np.linalg.norm(rate), rate / np.linalg.norm(rate)
    along = axis * (axis @ force)
    across, third = force - along, np.cross(axis, force)
    turn = angle * duration
    first = along * duration + (np.sin(turn) * across + (1.0 - np.cos(turn)) * third) / angle
    second = along * duration**2 / 2.0
    second = second + ((1.0 - np.cos(turn)) * across + (turn - np.sin(turn)) * third) / angle**2
    np.testing.assert_allclose(made.rotation, begun @ Rotation.from_rotvec(rate * duration).as_matrix(), atol=1e-12)
    gravity = baseline.GRAVITY
    np.testing.assert_allclose(made.vectors[0], velocity + begun @ first + gravity * duration, atol=1e-11)
    expected = place + velocity * duration + begun @ second + gravity * duration**2 / 2.0
    np.testing.assert_allclose(made.vectors[1], expected, atol=1e-11)


def test_a_contact_corrects_by_the_variances():
    made = point_contacts.PointContacts(CONTACTS, still())
    place, contact, noise = 4e-4, 9e-4, point_contacts.KINEMATICS**2
    made.covariance = np.diag(np.repeat((0.0, 0.0, place, *[contact] * 4, 0.0, 0.0), 3))
    before, measured = made.vectors.copy(), made._places.copy()
    off = np.array((0.01, -0.02, 0.03))
    measured[0] += made.rotation.T @ off
    made.correct(np.array((0,)), measured)
    share = off / (place + contact + noise)
    np.testing.assert_allclose(made.vectors[1] - before[1], -place * share, atol=1e-15)
    np.testing.assert_allclose(made.vectors[2] - before[2], contact * share, atol=1e-15)
    left = place - place**2 / (place + contact + noise)
    np.testing.assert_allclose(np.diag(made.covariance)[6:9], left, rtol=1e-9)


def test_a_robot_that_stands_still_stays():
    sample = still()
    made = point_contacts.PointContacts(CONTACTS, sample)
    begun = made.pose
    for _ in range(100):
        made.cycle(sample, np.full(4, 200.0))
    np.testing.assert_allclose(made.pose, begun, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rolling_squares", "point_contacts"])
def test_baselines_learn_the_bias_at_rest(method):
    sample, bias = still(), 3.5e-3
    maker = {"rolling_squares": rolling_squares.RollingSquares, "point_contacts": point_contacts.PointContacts}[method]
    made, period, count = maker(CONTACTS, sample), log.PERIOD, 600
    sample.imu.angular[2] = bias
    for cycle in range(count):
        # the heading of an IMU is the integral of its gyroscope
        sample.imu.orientation[:] = Rotation.from_rotvec((0.0, 0.0, bias * period * (cycle + 1))).as_quat()
        made.cycle(sample, np.full(4, 200.0))
    assert abs(made.pose[3]) < 0.02 * bias * period * count


def rows(count=3):
    """Return a log of a robot that stands tilted."""
    size = 6 + len(baseline.WheeledBody(CONTACTS)._robot.dofs[6:])
    position = np.tile(np.linspace(-0.1, 0.1, size), (count, 1))
    zeros = np.zeros((count, size))
    time = 0.005 * np.arange(1, count + 1)
    return log.Log(time, position, zeros, zeros, np.zeros((count, 6)), np.zeros((count, 4, 3)), np.full(4, 0.078))


def test_exact_sensors_measure_the_truth():
    logged = rows()
    for row, sample in enumerate(measurements.Measurements(logged, 1, 0.0)):
        np.testing.assert_array_equal(sample.joints.position, logged.position[row, 6:])
        turn = Rotation.from_quat(sample.imu.orientation).as_matrix()
        # the link of the IMU is fixed to the pelvis
        fixed = baseline.WheeledBody(CONTACTS).to_imu
        np.testing.assert_allclose(turn, sample.truth.rotation @ fixed, atol=1e-12)
        np.testing.assert_allclose(sample.imu.acceleration, 9.81 * turn[2], atol=1e-9)


@pytest.mark.slow
def test_errors_repeat_by_the_seed():
    def measured(seed, noise):
        made = measurements.Measurements(rows(), seed, noise)
        return np.array([(*sample.imu.angular, *sample.joints.position) for sample in made]), made.radii

    first, radii = measured(4, 1.0)
    np.testing.assert_array_equal(measured(4, 1.0)[0], first)
    assert np.abs(measured(5, 1.0)[0] - first).max() > 1e-4
    wider = measured(4, 3.0)[1] / 0.078 - 1.0
    np.testing.assert_allclose(wider, 3.0 * (radii / 0.078 - 1.0), rtol=0.02)


@pytest.mark.parametrize(
    ("options", "what"),
    [
        (["--course", "lopo"], "no course 'lopo'"),
        (["--seed", "-1"], "the seed is -1"),
        (["--noise", "nan"], "the noise is nan"),
        (["--draws", "0"], "draws is 0"),
        (["--world", "nowhere.yaml"], "no file 'nowhere.yaml'"),
        (["--method", "magic"], "invalid choice: 'magic'"),
    ],
)
def test_a_wrong_option_is_refused(options, what, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["estimation.py", *options])
    with pytest.raises(SystemExit) as ended:
        part("estimation").main()
    assert ended.value.code == 2 and what in capsys.readouterr().err


def test_a_wrong_course_file_is_refused(tmp_path, monkeypatch, capsys):
    (tmp_path / "course.yaml").write_text("legs: [{x: 1.0}, {trun: 0.3}]\n")
    monkeypatch.setattr(sys, "argv", ["estimation.py", "--course", str(tmp_path / "course.yaml")])
    with pytest.raises(SystemExit) as ended:
        part("estimation").main()
    assert ended.value.code == 2 and "course.yaml:1:19" in capsys.readouterr().err
