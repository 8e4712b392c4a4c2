"""What the simulation asks of every physics engine, by the laws of mechanics; a new one is added to ENGINES."""

import math
from contextlib import closing

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.needs import needs_bullet
from support.simulation.engine_state import base_state, joint_states

from solfer.errors import SimulationError
from solfer.model.urdf.description import Description
from solfer.simulation.bullet import BulletEngine
from solfer.simulation.loading.wheels import TorusWheel
from solfer.simulation.mujoco import MujocoEngine
from solfer.simulation.physics import STEP, CameraView
from solfer.simulation.world.records import Friction, StairsRecord, WorldRecord
from solfer.simulation.world.world import World

pytestmark = pytest.mark.needs("simulation")
ENGINES = [MujocoEngine] if needs_bullet.args[0] else [BulletEngine, MujocoEngine]
GRAVITY = 9.81
GREY = (0.5, 0.5, 0.5, 1.0)
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
INERTIA = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
ROBOT = f"""<robot name="pair">
  <link name="body"><inertial><origin xyz="0.1 0 0"/><mass value="3"/>{INERTIA}</inertial>
    <collision><geometry><box size="1 1 0.2"/></geometry></collision></link>
  <joint name="mount" type="fixed"><parent link="body"/><child link="plate"/><origin xyz="0 0 0.1"/></joint>
  <link name="plate"/>
  <joint name="wheel" type="continuous"><parent link="body"/><child link="disc"/><origin xyz="0 0 0.5"/>
    <axis xyz="0 0 1"/></joint>
  <link name="disc"><inertial><mass value="1"/>{INERTIA}</inertial></link>
  <joint name="slave" type="continuous"><parent link="body"/><child link="ring"/><origin xyz="0 0 0.8"/>
    <axis xyz="0 0 1"/></joint>
  <link name="ring"><inertial><mass value="1"/>{INERTIA}</inertial></link></robot>"""
"""A body with two discs about the vertical."""

MASS = 5.0
PENDULUM = """<robot name="pendulum"><link name="stand"/>
  <joint name="upper" type="{kind}"><parent link="stand"/><child link="rod"/><axis xyz="0 1 0"/>{limit}</joint>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="lower" type="continuous"><parent link="rod"/><child link="tip"/><origin xyz="0 0 -1"/>
    <axis xyz="0 1 0"/></joint>
  <link name="tip"><inertial><origin xyz="0 0 -0.3"/><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
"""Two rods behind each other."""

BALL = """<robot name="ball"><link name="ball"><inertial><mass value="2"/>
  <inertia ixx="0.008" iyy="0.008" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"""
"""A ball whose mass is distributed evenly, 2/5 m r^2."""


CART = """<robot name="cart"><link name="rail"/>
  <joint name="way" type="prismatic"><parent link="rail"/><child link="slide"/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" effort="0" velocity="9"/></joint>
  <link name="slide"><inertial><mass value="1"/>{inertia}</inertial></link>
  <joint name="height" type="prismatic"><parent link="slide"/><child link="fork"/><axis xyz="0 0 1"/>
    <limit lower="-9" upper="9" effort="0" velocity="9"/></joint>
  <link name="fork"><inertial><mass value="20"/>{inertia}</inertial></link>
  <joint name="axle" type="continuous"><parent link="fork"/><child link="tire"/>
    <origin rpy="{camber} 0 0"/><axis xyz="0 1 0"/></joint>
  <link name="tire"><inertial><origin xyz="0 0.1 0"/><mass value="2"/>{inertia}</inertial>
    <collision><origin xyz="0 0.1 0"/><geometry><sphere radius="{radius}"/></geometry></collision></link></robot>"""
"""A wheel that leans to the side below a load that moves along x and z."""


@pytest.fixture(params=ENGINES)
def engine(request):
    with closing(request.param()) as made:
        yield made


def load(engine, floats=True, friction=Friction()):  # noqa: B008
    """Load the robot without losses: a joint turns freely unless it is driven."""
    robot = engine.load_robot(Description.from_text(ROBOT), ("wheel", "slave"), friction, floats=floats)
    robot.set_losses([0.0, 0.0], [0.0, 0.0], np.full(2, 0.1))
    return robot


def load_pendulum(engine, limits=""):
    kind = "revolute" if limits else "continuous"
    text = PENDULUM.format(kind=kind, limit=limits and f'<limit {limits} effort="100" velocity="100"/>')
    robot = engine.load_robot(Description.from_text(text), ("upper", "lower"), Friction(), floats=False)
    robot.set_losses([0.0, 0.0], [0.0, 0.0], np.full(2, 0.1))
    return robot


def load_ball(engine, friction):
    return engine.load_robot(Description.from_text(BALL), (), Friction(default=friction), floats=True)


def load_cart(engine, camber, wheel):
    description = Description.from_text(CART.format(inertia=INERTIA, camber=camber, radius=wheel.ring + wheel.tube))
    joints = ("way", "height", "axle")
    robot = engine.load_robot(description, joints, Friction(), floats=False, wheels={"tire": wheel})
    robot.set_losses([0.0] * 3, [0.0] * 3, np.ones(3))
    return robot


def slope(angle):
    """Return the normal of a plane that rises along x."""
    return -math.sin(angle), 0.0, math.cos(angle)


def run(engine, steps):
    for _ in range(steps):
        engine.step()


def test_a_robot_falls_freely(engine):
    robot = load(engine)
    robot.place_base((1.0, 2.0, 50.0), UPRIGHT)
    run(engine, 100)
    state, time = base_state(robot), 100 * STEP
    np.testing.assert_allclose(state.linear, (0.0, 0.0, -GRAVITY * time), atol=1e-6)
    np.testing.assert_allclose(state.position, (1.0, 2.0, 50.0 - GRAVITY * time**2 / 2.0), atol=1e-3)
    np.testing.assert_allclose(state.orientation, UPRIGHT, atol=1e-9)


def test_masses_and_fixed_links_are_those_of_the_description(engine):
    robot = load(engine)
    assert robot.mass() == pytest.approx(MASS) and robot.links[-1] == "body"
    assert robot.owner == {"body": "body", "plate": "body", "disc": "disc", "ring": "ring"}
    robot.place_base((0.0, 0.0, 2.0), UPRIGHT)
    np.testing.assert_allclose(robot.center_of_mass(), (0.3 / MASS, 0.0, 2.0 + 1.3 / MASS), atol=1e-6)


def test_a_torque_accelerates_and_a_motor_holds(engine):
    robot = load(engine, floats=False)
    wheel, slave = robot.group([0]), robot.group([1])
    for _ in range(100):
        wheel.apply_torques(np.array([0.2]))
        slave.hold_speeds(np.array([0.5]), (10.0,))
        engine.step()
    states = joint_states(robot)
    assert states.velocity == pytest.approx((0.2 / 0.1 * 100 * STEP, 0.5), rel=1e-3)
    assert states.position[0] == pytest.approx(0.5 * 2.0 * (100 * STEP) ** 2, rel=0.02)


def test_a_motor_is_no_stronger_than_its_effort(engine):
    robot = load(engine, floats=False)
    robot.group([0]).hold_speeds(np.array([100.0]), (0.3,))
    run(engine, 10)
    states = joint_states(robot)
    assert states.velocity[0] == pytest.approx(0.3 / 0.1 * 10 * STEP, rel=1e-3)
    assert states.effort[0] == pytest.approx(0.3, rel=1e-3)


def test_friction_and_damping_brake_joints(engine):
    robot = engine.load_robot(Description.from_text(ROBOT), ("wheel", "slave"), Friction(), floats=False)
    robot.set_losses([0.0, 0.5], [0.1, 0.0], np.full(2, 0.1))
    robot.place_joint(0, 0.0, 3.0)
    robot.place_joint(1, 0.0, 3.0)
    run(engine, 100)
    rubbed, damped = joint_states(robot).velocity
    assert rubbed == pytest.approx(3.0 - 0.1 / 0.1 * 100 * STEP, rel=1e-2)
    assert damped == pytest.approx(3.0 * math.exp(-0.5 / 0.1 * 100 * STEP), rel=3e-2)


def test_a_gear_keeps_a_ratio_of_speeds(engine):
    robot = load(engine, floats=False)
    robot.add_gear(1, 0, -2.0)
    robot.group([0]).hold_speeds(np.array([0.5]), (10.0,))
    run(engine, 200)
    leader, follower = joint_states(robot).velocity
    assert leader == pytest.approx(0.5, rel=1e-2) and follower == pytest.approx(-1.0, rel=1e-2)


def test_a_push_acts_for_one_step(engine):
    robot = load(engine)
    robot.place_base((0.0, 0.0, 50.0), UPRIGHT)
    robot.push("plate", [10.0, 0.0, 0.0], [0.0] * 3, robot.center_of_mass().tolist())
    run(engine, 1)
    impulse = np.array(base_state(robot).linear)
    run(engine, 1)
    assert impulse[0] == pytest.approx(10.0 * STEP / MASS, rel=1e-3)
    assert base_state(robot).linear[0] == pytest.approx(impulse[0], rel=1e-3)


def test_contacts_carry_the_weight(engine):
    robot = load(engine)
    ground = engine.add_plane((0.0, 0.0, 1.0), 1.0)
    robot.place_base((0.0, 0.0, 0.1), UPRIGHT)
    assert robot.contacts() == []
    run(engine, 500)
    contacts = robot.contacts()
    assert {point.link for point in contacts} == {"body"}
    np.testing.assert_allclose(sum(np.array(point.force) for point in contacts), (0.0, 0.0, MASS * GRAVITY), atol=0.5)
    near = robot.closest_points(ground, 0.05, "body")
    assert near and all(abs(point.distance) < 1e-3 and abs(point.position[2]) < 2e-3 for point in near)
    assert robot.closest_points(ground, 0.05, "disc") == []
    low, high = robot.box_around()
    assert low[2] == pytest.approx(0.0, abs=0.05) and high[2] >= 0.199


@pytest.mark.parametrize(("coefficient", "distance"), [(1.0, 0.0), (0.0, 0.5 * 10.0 / MASS * 0.3**2)])
def test_a_slippery_robot_slides(engine, coefficient, distance):
    robot = load(engine)
    engine.add_plane((0.0, 0.0, 1.0), 1.0)
    robot.place_base((0.0, 0.0, 0.1), UPRIGHT)
    robot.set_friction("plate", coefficient)
    for _ in range(300):
        robot.push("body", [10.0, 0.0, 0.0], [0.0] * 3, robot.center_of_mass().tolist())
        engine.step()
    assert base_state(robot).position[0] == pytest.approx(distance, rel=0.05, abs=1e-3)


def inertia_of_rods(second):
    both = 0.5 * (0.09 + 0.3 * math.cos(second)) + 0.01
    return np.array([[0.28 + 0.5 * (1.09 + 0.6 * math.cos(second)), both], [both, 0.055]])


def rods(_, state):
    """Compute rates of the angles of two rods by Lagrange's equations, independent of every engine."""
    first, second, *speeds = state
    swirl = 0.15 * math.sin(second)
    lower = 0.15 * GRAVITY * math.sin(first + second)
    force = (
        swirl * (2.0 * speeds[0] * speeds[1] + speeds[1] ** 2) - GRAVITY * math.sin(first) - lower,
        -swirl * speeds[0] ** 2 - lower,
    )
    return (*speeds, *np.linalg.solve(inertia_of_rods(second), force))


def energy_of_rods(states):
    (first, second), speeds = states.position, np.array(states.velocity)
    height = -GRAVITY * (math.cos(first) + 0.15 * math.cos(first + second))
    return height + speeds @ inertia_of_rods(second) @ speeds / 2.0


def test_pendulums_swing_by_the_laws_of_mechanics(engine):
    robot = load_pendulum(engine)
    robot.place_joints([0.6, 0.4])
    run(engine, 1000)
    expected = solve_ivp(rods, (0.0, 1.0), (0.6, 0.4, 0.0, 0.0), rtol=1e-9, atol=1e-9).y[:, -1]
    states = joint_states(robot)
    np.testing.assert_allclose((*states.position, *states.velocity), expected, atol=0.02)


def test_free_motion_keeps_its_energy(engine):
    robot = load_pendulum(engine)
    robot.place_joints([1.0, 0.5])

    begin = energy_of_rods(joint_states(robot))
    for _ in range(30):
        run(engine, 100)
        assert energy_of_rods(joint_states(robot)) == pytest.approx(begin, abs=0.2)  # by the step; of 11 J


def test_a_joint_stops_at_its_limit(engine):
    robot = load_pendulum(engine, limits='lower="-0.3" upper="0.5"')
    robot.place_joints([0.4, 0.0])
    upper = robot.group([0])
    for _ in range(1000):
        upper.apply_torques(np.array([20.0]))
        engine.step()
    assert joint_states(robot).position[0] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("angle", "slides"), [(0.38, False), (0.44, True)])
def test_friction_holds_up_to_its_cone(engine, angle, slides):
    """Coefficients 0.9 and 0.5 are multiplied: arctan 0.45 is 0.4229 rad."""
    robot = load(engine, friction=Friction(default=0.9))
    engine.add_plane(slope(angle), 0.5)
    robot.place_base(np.multiply(slope(angle), 0.1), (0.0, -math.sin(angle / 2.0), 0.0, math.cos(angle / 2.0)))
    run(engine, 500)
    begin = np.array(base_state(robot).position)
    run(engine, 500)
    way = np.linalg.norm(np.subtract(base_state(robot).position, begin))
    acceleration = GRAVITY * (math.sin(angle) - 0.45 * math.cos(angle))
    assert way == pytest.approx(1.5 * acceleration * 0.25 if slides else 0.0, rel=0.1, abs=2e-4)


def test_a_ball_rolls_down_a_slope(engine):
    """It does not slip, so that a third of its energy turns it: 5/7 g sin(angle)."""
    angle = 0.1
    robot = load_ball(engine, 1.0)
    engine.add_plane(slope(angle), 1.0)
    robot.place_base(np.multiply(slope(angle), 0.1), UPRIGHT)
    run(engine, 1000)
    state = base_state(robot)
    speed = np.linalg.norm(state.linear)
    assert speed == pytest.approx(5.0 / 7.0 * GRAVITY * math.sin(angle), rel=0.01)
    assert state.angular == pytest.approx((0.0, -speed / 0.1, 0.0), rel=0.01, abs=1e-3)


def test_what_falls_does_not_bounce(engine):
    robot = load_ball(engine, 1.0)
    engine.add_plane((0.0, 0.0, 1.0), 1.0)
    robot.place_base((0.0, 0.0, 0.3), UPRIGHT)
    run(engine, 1000)
    assert base_state(robot).position[2] == pytest.approx(0.1, abs=1e-3)
    assert np.linalg.norm(base_state(robot).linear) < 1e-3


@pytest.mark.parametrize("camber", [-20.0, 0.0, 10.0])
@pytest.mark.parametrize(("ring", "tube"), [(0.010, 0.068), (0.25, 0.03)])
def test_a_wheel_rolls_as_its_torus(engine, ring, tube, camber):
    """Its contact is at c - R (n - a (a.n)) / |n - a (a.n)| - r n, and it rolls by R + r cos(camber).

    Its centre is beside the origin of its link. PyBullet has a ball, which is near a torus with a small ring.
    """
    is_ball = isinstance(engine, BulletEngine)
    if is_ball and ring > tube:
        pytest.skip("a ball is no wheel with a thin tire")
    angle = math.radians(camber)
    wheel = TorusWheel((0.0, 0.1, 0.0), (0.0, 3.0, 0.0), ring, tube=tube)
    robot = load_cart(engine, angle, wheel)
    engine.add_plane((0.0, 0.0, 1.0), 1.0)
    y, z = 0.1 * math.cos(angle), 0.1 * math.sin(angle)  # of the centre from the origin of the link
    robot.place_joints([0.0, ring * math.cos(angle) + tube - z, 0.0])
    drive = robot.group([2])
    ways = []
    for _ in range(2):
        for _ in range(400):
            drive.hold_speeds(np.array([2.0]), (100.0,))
            engine.step()
        ways.append(joint_states(robot).position)
    (start, _, first), (end, height, last) = ways
    assert (end - start) / (last - first) == pytest.approx(ring + tube * math.cos(angle), abs=1e-3)
    assert height + z == pytest.approx(ring * math.cos(angle) + tube, abs=1e-3)
    place = np.average([point.position[1] for point in robot.contacts()])
    assert place == pytest.approx(y if is_ball else y + ring * math.sin(angle), abs=1e-3)


def test_equal_calls_give_equal_motions_to_the_bit(request):
    for make in ENGINES:
        ends = []
        for _ in range(2):
            with closing(make()) as engine:
                robot = load(engine)
                engine.add_plane((0.0, 0.0, 1.0), 1.0)
                robot.place_base((0.0, 0.0, 0.3), (0.1, 0.0, 0.0, math.sqrt(0.99)))
                run(engine, 300)
                ends.append((base_state(robot), joint_states(robot)))
        assert ends[0] == ends[1]


def test_what_was_kept_comes_back_to_the_bit(engine):
    robot = load(engine)
    engine.add_plane((0.0, 0.0, 1.0), 1.0)
    robot.place_base((0.0, 0.0, 0.15), UPRIGHT)
    run(engine, 150)
    state = engine.save_state()
    run(engine, 50)
    after = base_state(robot), joint_states(robot)
    engine.restore_state(state)
    run(engine, 50)
    assert (base_state(robot), joint_states(robot)) == after
    engine.remove_state(state)


def test_boxes_stand_are_put_and_stopped(engine):
    engine.add_plane((0.0, 0.0, 1.0), 1.0)
    wall = engine.add_box((1.0, 1.0, 1.0), ((5.0, 0.0, 3.0), UPRIGHT), 0.0, friction=1.0, colour=GREY)
    crate = engine.add_box((0.2, 0.2, 0.2), ((0.0, 0.0, 1.0), UPRIGHT), 2.0, friction=1.0, colour=GREY)
    run(engine, 100)
    fallen = engine.pose(crate)[0]
    assert fallen[2] < 0.97 and engine.pose(wall)[0] == pytest.approx((5.0, 0.0, 3.0))
    low, high = engine.box_around(wall)
    assert low == pytest.approx((4.5, -0.5, 2.5), abs=0.05) and high == pytest.approx((5.5, 0.5, 3.5), abs=0.05)
    engine.place(crate, ((0.0, 0.0, 2.0), UPRIGHT))
    engine.stop(crate)
    run(engine, 1)
    assert engine.pose(crate)[0][2] == pytest.approx(2.0, abs=1e-4)
    engine.set_friction(crate, 0.2)


STAIRS = StairsRecord(position=(0.0, 0.0), count=3, rise=0.15, tread=0.4, width=1.0)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_ball_rests_on_each_step_of_stairs(engine, number):
    World(engine, WorldRecord(stairs={"steps": STAIRS}))
    robot = load_ball(engine, 1.0)
    place = 0.4 * (number - 0.5)
    robot.place_base((place, 0.0, 0.15 * number + 0.11), UPRIGHT)
    run(engine, 500)
    assert base_state(robot).position == pytest.approx((place, 0.0, 0.15 * number + 0.1), abs=1e-3)


def test_what_rests_on_a_box_falls_when_it_moves(engine):
    """A ball falls onto a shelf that is put lower, and beside one that is put away."""
    shelf = engine.add_box((1.0, 1.0, 0.2), ((0.0, 0.0, 0.9), UPRIGHT), 0.0, friction=1.0, colour=GREY)
    robot = load_ball(engine, 1.0)
    robot.place_base((0.0, 0.0, 1.1), UPRIGHT)
    run(engine, 200)
    assert base_state(robot).position[2] == pytest.approx(1.1, abs=1e-3)
    engine.place(shelf, ((0.0, 0.0, 0.4), UPRIGHT))
    run(engine, 1000)
    assert base_state(robot).position[2] == pytest.approx(0.6, abs=1e-3)
    engine.place(shelf, ((5.0, 0.0, 0.4), UPRIGHT))
    run(engine, 100)
    assert base_state(robot).position[2] == pytest.approx(0.6 - 0.5 * GRAVITY * 0.01, abs=2e-3)


def test_a_ball_pushes_a_box_and_shares_its_momentum(engine):
    """They slide without friction, and do not bounce: the momentum stays, and both end with one speed."""
    engine.add_plane((0.0, 0.0, 1.0), 0.0)
    crate = engine.add_box((0.2, 0.2, 0.2), ((0.5, 0.0, 0.1), UPRIGHT), 3.0, friction=0.0, colour=GREY)
    robot = load_ball(engine, 0.0)
    robot.place_base((0.0, 0.0, 0.1), UPRIGHT)
    for _ in range(200):
        robot.push("ball", [20.0, 0.0, 0.0], [0.0] * 3, robot.center_of_mass().tolist())
        engine.step()
    assert base_state(robot).linear[0] == pytest.approx(2.0, abs=1e-3)
    run(engine, 300)
    begin = engine.pose(crate)[0][0]
    run(engine, 100)
    speed = (engine.pose(crate)[0][0] - begin) / (100 * STEP)
    momentum = 3.0 * speed + 2.0 * base_state(robot).linear[0]
    assert momentum == pytest.approx(4.0, rel=0.01)
    assert speed >= 0.8 - 1e-3 and base_state(robot).linear[0] <= speed + 1e-3


GRID = np.array([[0.0, 0.1, 0.3, 0.2], [0.05, 0.2, 0.1, 0.4], [0.3, 0.1, 0.0, 0.6]]) + 1.0
"""Heights that differ along both axes, in squares of half a metre [m]."""


def add_grid(engine, heights, spacing=0.5, pose=((0.0, 0.0, 0.0), UPRIGHT)):
    return engine.add_grid(heights, spacing, pose, friction=1.0, colour=GREY)


def lowered(robot, body, place):
    """Put a ball above a place and move it down by its distance until it touches; return the point that it touches."""
    height = 3.0
    for _ in range(500):
        robot.place_base((*place, height), UPRIGHT)
        nearest = min(robot.closest_points(body, 5.0), key=lambda point: point.distance)
        if abs(nearest.distance) < 1e-6:
            break
        height -= nearest.distance
    return nearest.position


def heights_at(x, y):
    """Interpolate GRID linearly in the triangles by both diagonals; (x, y) in squares from its first height."""
    i, j = min(int(x), 1), min(int(y), 2)
    u, v = x - i, y - j
    low, right, up, far = GRID[i, j], GRID[i + 1, j], GRID[i, j + 1], GRID[i + 1, j + 1]
    rising = low + u * (right - low) + v * (far - right) if u > v else low + v * (up - low) + u * (far - up)
    falling = low + u * (right - low) + v * (up - low)
    if u + v > 1.0:
        falling = far + (1.0 - u) * (up - far) + (1.0 - v) * (right - far)
    return rising, falling


@pytest.mark.parametrize("place", [(0.1, 0.1), (-0.3, -0.6), (0.35, 0.55), (-0.2, 0.4), (0.3, -0.3)])
def test_a_ball_touches_a_grid_where_its_heights_are(engine, place):
    """A turned and moved grid is the same one in its own axes."""
    yaw = 0.5
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    pose = (2.0, -1.0, 0.3), (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
    body = add_grid(engine, GRID, pose=pose)
    x, y, z = lowered(load_ball(engine, 1.0), body, turn @ place + pose[0][:2])
    own = (np.array([x, y]) - pose[0][:2]) @ turn / 0.5 + (1.0, 1.5)
    assert min(abs(z - 0.3 - height) for height in heights_at(*own)) < 2e-3


def test_a_grid_has_the_extent_of_its_heights(engine):
    low, high = engine.box_around(add_grid(engine, GRID))
    assert low[:2] == pytest.approx((-0.5, -0.75), abs=0.02) and low[2] <= 1.001
    assert high == pytest.approx((0.5, 0.75, 1.6), abs=0.02)


def test_a_ball_rests_in_a_bowl(engine):
    x, y = np.meshgrid(*[np.arange(-10, 11) * 0.1] * 2, indexing="ij")
    add_grid(engine, 0.5 * (abs(x) + abs(y)), spacing=0.1)
    robot = load_ball(engine, 1.0)
    robot.place_base((0.0, 0.0, 0.15), UPRIGHT)
    run(engine, 1000)
    state = base_state(robot)
    assert np.linalg.norm(state.linear) < 0.01
    np.testing.assert_allclose(state.position, (0.0, 0.0, 0.1 * math.sqrt(1.5)), atol=2e-3)


def test_a_ball_rolls_down_a_slanted_grid(engine):
    """As on a plane: its squares have no edges that brake it."""
    angle = 0.1
    heights = math.tan(angle) * 0.1 * np.repeat(np.arange(61.0)[:, None], 11, axis=1)
    add_grid(engine, heights, spacing=0.1, pose=((-3.0, 0.0, 0.0), UPRIGHT))
    robot = load_ball(engine, 1.0)
    robot.place_base(np.array([-1.0, 0.03, 5.0 * math.tan(angle)]) + np.multiply(slope(angle), 0.1), UPRIGHT)
    run(engine, 1000)
    speed = np.linalg.norm(base_state(robot).linear)
    assert speed == pytest.approx(5.0 / 7.0 * GRAVITY * math.sin(angle), rel=0.02)


def test_a_ball_falls_into_a_gap_between_grids(engine):
    for y in (-1.0, 1.0):
        add_grid(engine, np.zeros((3, 3)), pose=((0.0, y, 0.0), UPRIGHT))
    robot = load_ball(engine, 1.0)
    for y, falls in ((0.0, True), (0.8, False), (-0.8, False)):
        robot.place_base((0.2, y, 0.1), UPRIGHT)
        run(engine, 500)
        assert (base_state(robot).position[2] < -0.5) == falls


def test_a_camera_sees_a_grid(engine):
    engine.add_grid(GRID, 0.5, ((0.0, 0.0, 0.0), UPRIGHT), friction=1.0, colour=(1.0, 0.0, 0.0, 1.0))
    picture = engine.render(CameraView((0.0, 0.0, 1.2), 2.0, 0.0, pitch=-90.0, field_of_view=60.0, size=(40, 30)))
    red, green, _ = picture.colours[15, 20].astype(int)
    assert red > green + 50 and not picture.is_empty[15, 20] and picture.is_empty[0, 0]


def test_a_camera_sees_colours_and_distances(engine):
    engine.add_tiles((1.0, 1.0, 0.2), [(1.0, 0.0, 0.0, 1.0)])
    picture = engine.render(CameraView((0.0, 0.0, 0.1), 2.0, 0.0, pitch=-90.0, field_of_view=60.0, size=(40, 30)))
    assert picture.colours.shape == (30, 40, 3) and picture.colours.dtype == np.uint8
    red, green, _ = picture.colours[15, 20].astype(int)
    assert red > green + 50 and not picture.is_empty[15, 20] and picture.is_empty[0, 0]
    assert picture.depth[15, 20] == pytest.approx(2.0, rel=0.02)


def test_a_robot_that_cannot_be_is_refused(engine):
    with pytest.raises(SimulationError, match="friction of links that the robot does not have: tail"):
        load(engine, friction=Friction(links={"tail": 1.0}))


def test_a_closed_engine_may_be_closed_again(engine):
    engine.close()
    engine.close()


class Slippery:
    """An engine whose plane has no friction."""

    def add_plane(self, normal, friction):
        return super().add_plane(normal, 0.0)


class Loaded:
    """An engine that knows its robot."""

    def load_robot(self, *given, **named):
        self.robot = super().load_robot(*given, **named)
        return self.robot


class Lighter(Loaded):
    """An engine with a gravity of 9.7 m/s^2."""

    def step(self):
        lift = 0.11 * self.robot.mass()
        self.robot.push("body", [0.0, 0.0, lift], [0.0] * 3, self.robot.center_of_mass().tolist())
        super().step()


class Forgetful(Loaded):
    """An engine whose restored states have lost their contacts."""

    def restore_state(self, state):
        super().restore_state(state)
        position, orientation, *_ = base_state(self.robot)
        self.robot.place_base((0.0, 0.0, 100.0), orientation)
        self.clear_contacts()
        self.robot.place_base(position, orientation)


@pytest.mark.parametrize("make", ENGINES)
@pytest.mark.parametrize(
    ("fault", "test"),
    [
        (Slippery, lambda engine: test_friction_holds_up_to_its_cone(engine, 0.38, slides=False)),
        (Lighter, test_a_robot_falls_freely),
        (Forgetful, test_what_was_kept_comes_back_to_the_bit),
    ],
)
def test_these_tests_find_engines_that_are_wrong(make, fault, test):
    with closing(type("Planted", (fault, make), {})()) as engine, pytest.raises(AssertionError):
        test(engine)
