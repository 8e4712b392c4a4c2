"""Joints that follow others are one degree of freedom: state, Jacobians, dynamics, drives."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.unit.mimics import FOLLOWERS, URDF, load
from support.unit.random_states import put, states

from solfer import Robot
from solfer.errors import ModelError
from solfer.model import Description, Kinematics
from solfer.model.urdf.cut import cut
from solfer.points import (
    AngularMomentum,
    CenterOfMass,
    Force,
    Handler,
    LinearAcceleration,
    LinearPoint,
    Posture,
    RollingAcceleration,
    RollingContact,
    SpatialPoint,
)
from solfer.tasks.constraints import TorqueLimits

STEP = 1e-6
LINKS = ("left", "right", "tip", "end", "hand")


@pytest.fixture(scope="module", params=[False, True], ids=["fixed", "floating"])
def robot(request):
    return load(request.param)


def selection(robot):
    """Return the map G from the free velocities to those of all DoFs, shape (n, n), with zeros for followers."""
    turned = np.eye(robot.size)
    for name, (leader, ratio, _) in FOLLOWERS.items():
        turned[robot.dof(name)] = 0.0
        turned[robot.dof(name), robot.dof(leader)] = ratio
    return turned


def test_followers_follow_in_the_state(robot):
    for position, velocity in states(robot):
        put(robot, position, velocity)
        for name, (leader, ratio, offset) in FOLLOWERS.items():
            dof, other = robot.dof(name), robot.dof(leader)
            assert robot.state.position[dof] == pytest.approx(ratio * position[other] + offset)
            assert robot.state.velocity[dof] == pytest.approx(ratio * velocity[other])
    assert robot.update() is False
    robot.state.position[robot.dof("far")] += 1.0  # what a message says of it does not count
    assert robot.update() is False


def test_followers_have_no_drive(robot):
    names = {robot.dofs[dof] for dof in robot.actuated}
    assert names == {"lift", "elbow", "grip", "curl"}
    assert robot.actuators.types[robot.dof("bend")] == "UNACTUATED"


def test_limits_of_followers_bound_their_leaders(robot):
    grip, curl, far = (robot.dof(name) for name in ("grip", "curl", "far"))
    lower, upper = robot.lower_limits, robot.upper_limits
    # spread is -1.5 grip + 0.1, far is 1.4 curl - 0.2; all have +-3 rad and 20 rad/s
    assert_allclose((lower.position[grip], upper.position[grip]), (-2.9 / 1.5, 3.1 / 1.5))
    assert_allclose((lower.position[curl], upper.position[curl]), (-2.0, 3.2 / 1.4))
    assert_allclose(upper.velocity[[grip, curl]], (20.0 / 1.5, 20.0 / 1.4))
    assert upper.position[far] == upper.velocity[far] == upper.torque[far] == np.inf
    apart = URDF.replace('multiplier="2" offset="-0.2"', 'multiplier="2" offset="20"')
    with pytest.raises(ModelError, match="joint 'far' follows 'curl', and no position"):
        Robot.load(apart)


@pytest.mark.parametrize(("velocity", "limit"), [("0", 3.0), ("1", 0.5), ("9", 3.0)])
def test_a_follower_without_a_speed_leaves_that_of_its_leader(velocity, limit):
    joint = (
        '<joint name="{0}" type="revolute"><parent link="a"/><child link="{0}"/>'
        '<limit lower="-1" upper="1" velocity="{1}" effort="1"/>{2}</joint><link name="{0}"/>'
    )
    follower = joint.format("follower", velocity, '<mimic joint="leader" multiplier="-2"/>')
    text = f'<robot name="r"><link name="a"/>{joint.format("leader", 3, "")}{follower}</robot>'
    kinematics = Kinematics(Description.from_text(text, "r.urdf"))
    assert kinematics.velocity_limit[kinematics.dofs.index("leader")] == limit


def test_torque_limits_leave_followers_alone(robot):
    put(robot, *next(states(robot)))
    limits = TorqueLimits(robot.dynamics, 0.002)
    limits.update()
    assert limits.rows == len(robot.actuated)
    assert not limits.matrix[:, [robot.dof(name) for name in FOLLOWERS]].any()


def test_jacobians_are_those_of_free_motions(robot):
    """Differences along motions that keep the ratios are the oracle, and followers' columns stay zero."""
    points = [SpatialPoint(link, robot, (0.1, 0.2, 0.3)) for link in LINKS]
    points += [Posture(robot), Posture(robot, list(FOLLOWERS))]
    points += [LinearPoint("end", robot) - LinearPoint("left", robot), CenterOfMass(robot)]
    points[-2:-2] = [points[-2].parts[0], points[-2].parts[1]]
    group = Handler(points)
    followers = [robot.dof(name) for name in FOLLOWERS]
    for position, velocity in list(states(robot))[:10]:
        around = []
        for time in (-STEP, STEP):
            put(robot, position + time * velocity, velocity)
            group.update()
            around.append([point.value.copy() for point in points])
        put(robot, position, velocity)
        group.update()
        for point, before, after in zip(points, *around, strict=True):
            rate = point.space.subtract(after, before) / (2.0 * STEP)
            assert_allclose(point.jacobian @ velocity, rate, atol=1e-6)
            assert not point.jacobian[:, followers].any()
            point.update()
            assert_allclose(point.jacobian @ velocity, rate, atol=1e-6)
        for link, point in zip(LINKS, points, strict=False):
            found = robot.kinematics.jacobian(link)
            assert_allclose(found[3:], point.jacobian[3:], atol=1e-12)
        assert_allclose(robot.kinematics.center_of_mass_jacobian, points[-1].jacobian, atol=1e-12)
        assert_allclose(robot.kinematics.velocity("end")[3:], points[3].jacobian[3:] @ velocity, atol=1e-12)


def test_the_momentum_is_that_of_followers_too(robot):
    point, followers = AngularMomentum(robot), [robot.dof(name) for name in FOLLOWERS]
    for position, velocity in list(states(robot))[:10]:
        put(robot, position, velocity)
        point.update()
        assert_allclose(point.jacobian @ robot.state.velocity, point.value, atol=1e-12)
        assert np.abs(point.value).max() > 1e-3 and not point.jacobian[:, followers].any()


@pytest.mark.parametrize("kind, moving", [(LinearAcceleration, LinearPoint), (RollingAcceleration, RollingContact)])
def test_accelerations_include_the_followers(robot, kind, moving):
    """Followers add to dJ v, too: central differences of the velocity along an accelerated motion show it."""
    where = {} if kind is LinearAcceleration else {"ring": 0.05, "tube": 0.02, "axis": (0.3, 1.0, -0.2)}
    point, body = kind("end", robot, **where), moving("end", robot, **where)
    for index, (position, velocity) in enumerate(list(states(robot))[:10]):
        acceleration = np.random.default_rng(index).uniform(-3.0, 3.0, robot.size)
        around = []
        for time in (-STEP, STEP):
            put(robot, position + time * velocity + 0.5 * time**2 * acceleration, velocity + time * acceleration)
            body.update()
            around.append(body.jacobian @ robot.state.velocity)
        robot.state.acceleration[:] = acceleration
        put(robot, position, velocity)
        point.update()
        expected = (around[1] - around[0]) / (2.0 * STEP)
        for value in (point.value, point.jacobian @ acceleration + point.offset):
            assert_allclose(value, expected, atol=3e-6 * max(1.0, np.abs(expected).max()))


def test_dynamics_are_those_of_free_motions(robot):
    """The robot without mimic tags, projected on the motions that remain, is the oracle for inertia and bias."""
    plain = Robot.load(URDF.replace("<mimic", "<ignored"), floating_base=robot.kinematics.base is not None)
    followers = [robot.dof(name) for name in FOLLOWERS]
    for position, velocity in list(states(robot))[:10]:
        put(robot, position, velocity)
        put(plain, robot.state.position, robot.state.velocity)
        turned, inertia = selection(robot), robot.dynamics.inertia
        expected = turned.T @ plain.dynamics.inertia @ turned
        expected[followers, followers] = 1.0
        assert_allclose(inertia, expected, atol=1e-9)
        assert_allclose(robot.dynamics.bias, turned.T @ plain.dynamics.bias, atol=1e-9)
        assert_allclose(robot.dynamics.inertia_inverse @ expected, np.eye(robot.size), atol=1e-8)
        assert_allclose(robot.kinematics.inertia(robot.state.position), expected, atol=1e-9)
        assert_allclose(
            robot.kinematics.bias(robot.state.position, robot.state.velocity), robot.dynamics.bias, atol=1e-9
        )


def test_forces_on_a_follower_hold_it(robot):
    force = Force("left", robot, (0.1, 0.2, 0.3))
    put(robot, *next(states(robot)))
    robot.state.torque[:] = np.random.default_rng(1).uniform(-5.0, 5.0, robot.size)
    robot.state.torque[[robot.dof(name) for name in FOLLOWERS]] = 0.0
    force.update()
    acceleration = robot.dynamics.inertia_inverse @ (
        robot.state.torque - robot.dynamics.bias + force.acceleration.jacobian.T @ force.value
    )
    held = force.acceleration.jacobian @ acceleration + force.acceleration.offset
    assert_allclose(held, 0.0, atol=1e-6)


def test_a_follower_has_no_actuator(tmp_path):
    file = tmp_path / "actuators.yaml"
    file.write_text("grip: {actuators: {bend: {type: SEA, Ks: 9, D: 1, B: 1, phi: 1, Torque_limit: 3}}}")
    with pytest.raises(ModelError, match="joint 'bend' follows 'curl'"):
        Robot.load(URDF, actuators=file)


def test_a_part_without_the_leader_moves_on_its_own():
    part = Description.from_text(cut(Description.from_text(URDF), "tip", "upper"))
    assert set(part.mimics) == {"far"} and part.mimics["far"].joint == "bend"
    assert_array_equal(Kinematics(part).followers.names, ("far",))
