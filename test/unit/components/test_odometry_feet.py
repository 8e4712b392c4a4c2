"""Odometry on feet that lift and land: a robot on four legs of three sliding joints, whose gait is known exactly."""

import math

import numpy as np
import pytest
import yaml

from solfer.components.odometry import Odometry
from solfer.components.odometry.sensing.measured_base import VelocityChange
from solfer.components.odometry.tags import OdometryTags
from solfer.robot import Robot

RATE, WEIGHT, RADIUS = 200.0, 150.0, 0.02  # [Hz], [N], [m]
HEIGHT, LIFT = 0.3, 0.05  # of the base and of a foot that swings [m]
HIPS = np.array([(x, y, -0.1) for x in (0.2, -0.2) for y in (0.15, -0.15)])
STANCE, PERIOD = 0.6, 0.4
"""Share of the time for which a foot of a trot stands, and the time of two steps [s]."""
OFFSETS = np.array((0.0, 0.5, 0.5, 0.0))
"""Phases of the feet of a trot."""


def urdf():
    """Write a box on four legs, whose joints slide along x, y and z."""
    body = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = f'<link name="world"/><link name="base">{body}</link>'
    text += '<joint name="free" type="floating"><parent link="world"/><child link="base"/></joint>'
    for leg, hip in enumerate(HIPS):
        parent = "base"
        for axis, way in zip("xyz", np.eye(3, dtype=int), strict=True):
            link = f"leg{leg}_{axis}"
            place = " ".join(map(str, hip if axis == "x" else np.zeros(3)))
            text += f'<link name="{link}">{body}</link><joint name="{link}_joint" type="prismatic">'
            text += f'<parent link="{parent}"/><child link="{link}"/><origin xyz="{place}"/>'
            text += f'<axis xyz="{" ".join(map(str, way))}"/>'
            text += '<limit lower="-1" upper="1" velocity="9" effort="999"/></joint>'
            parent = link
    return f'<robot name="walker">{text}</robot>'


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("walker")
    links = "".join(f'<link name="leg{leg}_z"/>' for leg in range(4))
    (folder / "walker.urdf").write_text(urdf())
    (folder / "walker.srdf").write_text(f'<robot name="walker"><group name="feet">{links}</group></robot>')
    forces = {f"force_{row + 1}": [0, 0, 0, *np.eye(3, dtype=int)[row].tolist()] for row in range(3)}
    contact = {"type": "contact_point", "position": [0.0, 0.0, 0.0], "offset": [0.0, 0.0, -RADIUS]}
    contacts = {
        f"contact{leg}": contact | {"name": f"foot{leg}", "end_frame": f"leg{leg}_z", "constraint_matrix": forces}
        for leg in range(4)
    }
    (folder / "contacts.yaml").write_text(yaml.safe_dump({"walker": {"contacts": contacts}}))
    return folder


class Walker:
    """A robot that goes as it is asked to, and measures it exactly.

    Args:
        files: Folder of its files.

    Attributes:
        place: Position of the base [m].
        heading: Its heading [rad].
        bias: By how much the accelerometer errs along x, y and z [m/s^2].
        gyro: By how much the gyroscope errs about the vertical [rad/s].
        ground: Height of the ground below a place of a foot; 0 by default.
    """

    def __init__(self, files):
        self.robot = Robot.load(files / "walker.urdf", files / "walker.srdf", contacts=files / "contacts.yaml")
        self.odometry = Odometry(self.robot, OdometryTags(method="filter", chain="feet"))
        self.odometry.set_rate(RATE)
        self.place = np.array((0.0, 0.0, HEIGHT))
        self.heading = self.time = self.bias = self.gyro = 0.0
        self.ground = lambda place: 0.0
        self._feet = HIPS + self.place
        self._feet[:, 2] = RADIUS
        self._velocity = np.zeros(3)
        self._change = np.zeros(3)
        self._measure(np.ones(4, dtype=bool), 0.0)
        self.robot.update()
        self.odometry.init()
        self.odometry._base.velocity_change = VelocityChange(self._change, np.zeros(3))

    @property
    def law(self):
        """The method."""
        return self.odometry.law

    @property
    def error(self):
        """Error of the position [m]."""
        return self.law.position - self.place

    def walk(self, duration, velocity, turn=0.0, *, stands=None):
        """Go on with a velocity in the world [m/s] and a yaw rate [rad/s], by a trot or on the feet that are given."""
        for _ in range(round(duration * RATE)):
            asked = np.array(velocity(self.time) if callable(velocity) else velocity, dtype=float)
            self._change[:] = asked - self._velocity + self.bias / RATE
            self.place += 0.5 * (asked + self._velocity) / RATE
            self._velocity = asked
            self.time += 1.0 / RATE
            self.heading += turn / RATE
            phase = (self.time / PERIOD + OFFSETS) % 1.0
            standing = phase < STANCE if stands is None else np.array(stands)
            self._swing(standing, phase, asked)
            self._measure(standing, turn)
            self.odometry.model.update()
            self.odometry.update()

    def _swing(self, standing, phase, velocity):
        """Move the feet that do not stand towards where they land."""
        turned = self._axes() @ HIPS.T
        for foot in np.flatnonzero(~standing):
            left = max((1.0 - phase[foot]) * PERIOD, 1.0 / RATE)
            goal = self.place + turned[:, foot] + 0.5 * STANCE * PERIOD * velocity
            goal[2] = self.ground(goal) + RADIUS
            share = min(1.0 / (left * RATE), 1.0)
            height = LIFT * math.sin(math.pi * (phase[foot] - STANCE) / (1.0 - STANCE)) if left > 1.5 / RATE else 0.0
            self._feet[foot, :2] += share * (goal - self._feet[foot])[:2]
            self._feet[foot, 2] = goal[2] + max(height, 0.0)

    def _axes(self):
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        return np.array(((cosine, -sine, 0.0), (sine, cosine, 0.0), (0.0, 0.0, 1.0)))

    def _measure(self, standing, turn):
        """Write joints, torques and IMU into the State; the feet that stand share the weight."""
        state = self.robot.state
        before = state.position[6:].copy()
        state.position[6:] = (self._axes().T @ (self._feet - self.place).T - HIPS.T).T.ravel()
        state.velocity[6:] = (state.position[6:] - before) * RATE + 1e-3
        state.position[3:6] = 0.0, 0.0, self.heading
        state.velocity[3:6] = 0.0, 0.0, turn + self.gyro + 1e-9 * (round(self.time * RATE) % 2)
        state.torque[6:].reshape(4, 3)[:, 2] = np.where(standing, -WEIGHT / max(standing.sum(), 1), 0.0)


@pytest.fixture
def walker(files):
    return Walker(files)


@pytest.mark.parametrize(("velocity", "turn"), [((0.5, 0.0, 0.0), 0.0), ((0.0, 0.3, 0.0), 0.0), ((0.3, 0.1, 0.0), 0.6)])
def test_a_trot_is_followed(walker, velocity, turn):
    """Feet land and lift twice a period: 0.5 % of the way, ahead, sideways and turning."""
    walker.walk(0.2, (0.0, 0.0, 0.0), stands=[True] * 4)
    walker.walk(4.0, velocity, turn)
    way = 4.0 * math.hypot(*velocity)
    assert np.abs(walker.error[:2]).max() < 5e-3 * way
    assert abs(walker.error[2]) < 5e-3
    assert walker.law.heading == pytest.approx(walker.heading, abs=1e-3)


def test_a_foot_that_lands_is_an_anchor_where_it_landed(walker):
    """On a floor it tells the height; on steps it does not, and the base rises with what stands on them."""
    walker.ground = lambda place: 0.1 if place[0] > 0.6 else 0.0
    walker.walk(0.2, (0.0, 0.0, 0.0), stands=[True] * 4)
    walker.walk(2.0, (0.5, 0.0, 0.05))
    assert np.abs(walker.error).max() < 0.02
    assert math.isnan(walker.law.ground.map.floor)


def test_what_lands_does_not_count_at_once(walker):
    feet = walker.law.feet
    weights = walker.law._motion.weights
    carried = np.array((50.0, 0.0, 50.0, 50.0))
    feet.weigh(carried, 30.0, 1.0 / RATE)
    assert weights.tolist() == carried.tolist()
    landed = np.full(4, 40.0)
    counted = []
    for _ in range(6):
        feet.weigh(landed, 30.0, 1.0 / RATE)
        counted.append(int(np.count_nonzero(weights)))
    assert counted == [3, 3, 3, 3, 4, 4] and set(weights.tolist()) == {40.0}
    feet.weigh(np.full(4, 12.0), 30.0, 1.0 / RATE)
    assert not weights.any()


def test_a_robot_at_rest_shows_the_bias_of_the_gyroscope(walker):
    """About the vertical as well: a second leaves 0.09 mrad/s of its noise."""
    walker.gyro = 1e-3
    walker.walk(1.1, (0.0, 0.0, 0.0), stands=[True] * 4)
    assert walker.law.kalman.state[9] == pytest.approx(1e-3, abs=2e-5)
    assert np.sqrt(walker.law.kalman.covariance[9, 9]) < 1.2e-4


def test_torques_tell_the_forces(walker):
    """Of the feet that carry the weight, without a pipe that brings them."""
    walker.walk(0.1, (0.0, 0.0, 0.0), stands=[True, False, True, True])
    np.testing.assert_allclose(walker.law.feet.forces, WEIGHT / 3.0 * np.array((1, 0, 1, 1)), rtol=1e-3, atol=1e-6)


def test_one_foot_measures_the_base(walker):
    """The accelerometer errs by 1 m/s^2: without the foot the base would be half a metre off."""
    walker.walk(0.2, (0.0, 0.0, 0.0), stands=[True] * 4)
    walker.bias = 1.0
    walker.walk(1.0, (0.3, 0.0, 0.0), stands=[False, True, False, False])
    assert np.abs(walker.error).max() < 0.02
    (status,) = walker.odometry.wheel_states().status
    assert "1 of 4" in status.message and status.level == 0


def test_without_a_foot_the_accelerometer_moves_the_base(walker, caplog):
    """A jump of 0.3 s that slows down; what is not measured is less and less known, and lifting is reported."""
    walker.walk(0.2, (0.0, 0.0, 0.0), stands=[True] * 4)
    walker.walk(1.0, lambda time: (0.5 * min(1.0, 2.0 * (time - 0.2)), 0.0, 0.0))
    before = walker.law.kalman.covariance[[4, 0], [4, 0]]
    start = walker.time
    walker.walk(0.3, lambda time: (0.5 - (time - start), 0.0, 1.0 - 9.81 * (time - start)), stands=[False] * 4)
    assert np.abs(walker.error).max() < 0.01
    assert (walker.law.kalman.covariance[[4, 0], [4, 0]] > 4.0 * before).all()
    assert "no foot" not in caplog.text
    walker.walk(1.0, (0.0, 0.0, 0.0), stands=[False] * 4)
    (status,) = walker.odometry.wheel_states().status
    assert status.level == 1 and "no foot has carried the robot for 1.3 s" in status.message
    assert caplog.text.count("no foot has carried") >= 1
