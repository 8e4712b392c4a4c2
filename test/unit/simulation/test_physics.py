"""What the simulation asks of every physics engine; a new one is added to ENGINES."""

import math
from contextlib import closing

import numpy as np
import pytest

from solfer.errors import SimulationError
from solfer.model.urdf.description import Description
from solfer.simulation.bullet import BulletEngine
from solfer.simulation.mujoco import MujocoEngine
from solfer.simulation.physics import STEP, CameraView
from solfer.simulation.world.records import Friction

pytestmark = pytest.mark.needs("simulation")
ENGINES = [BulletEngine, MujocoEngine]
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


@pytest.fixture(params=ENGINES)
def engine(request):
    with closing(request.param()) as made:
        yield made


def load(engine, floats=True, friction=Friction()):  # noqa: B008
    """Load the robot without losses: a joint turns freely unless it is driven."""
    robot = engine.load_robot(Description.from_text(ROBOT), ("wheel", "slave"), friction, floats=floats)
    robot.set_losses([0.0, 0.0], [0.0, 0.0], np.full(2, 0.1))
    return robot


def run(engine, steps):
    for _ in range(steps):
        engine.step()


def test_a_robot_falls_freely(engine):
    robot = load(engine)
    robot.place_base((1.0, 2.0, 50.0), UPRIGHT)
    run(engine, 100)
    state, time = robot.base_state(), 100 * STEP
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
        slave.hold_speeds(np.array([0.5]), [10.0])
        engine.step()
    states = robot.joint_states()
    assert states.velocity == pytest.approx((0.2 / 0.1 * 100 * STEP, 0.5), rel=1e-3)
    assert states.position[0] == pytest.approx(0.5 * 2.0 * (100 * STEP) ** 2, rel=0.02)


def test_a_motor_is_no_stronger_than_its_effort(engine):
    robot = load(engine, floats=False)
    robot.group([0]).hold_speeds(np.array([100.0]), [0.3])
    run(engine, 10)
    states = robot.joint_states()
    assert states.velocity[0] == pytest.approx(0.3 / 0.1 * 10 * STEP, rel=1e-3)
    assert states.effort[0] == pytest.approx(0.3, rel=1e-3)


def test_friction_and_damping_brake_joints(engine):
    robot = engine.load_robot(Description.from_text(ROBOT), ("wheel", "slave"), Friction(), floats=False)
    robot.set_losses([0.0, 0.5], [0.1, 0.0], np.full(2, 0.1))
    robot.place_joint(0, 0.0, 3.0)
    robot.place_joint(1, 0.0, 3.0)
    run(engine, 100)
    rubbed, damped = robot.joint_states().velocity
    assert rubbed == pytest.approx(3.0 - 0.1 / 0.1 * 100 * STEP, rel=1e-2)
    assert damped == pytest.approx(3.0 * math.exp(-0.5 / 0.1 * 100 * STEP), rel=3e-2)


def test_a_gear_keeps_a_ratio_of_speeds(engine):
    robot = load(engine, floats=False)
    robot.add_gear(1, 0, -2.0)
    robot.group([0]).hold_speeds(np.array([0.5]), [10.0])
    run(engine, 200)
    leader, follower = robot.joint_states().velocity
    assert leader == pytest.approx(0.5, rel=1e-2) and follower == pytest.approx(-1.0, rel=1e-2)


def test_a_push_acts_for_one_step(engine):
    robot = load(engine)
    robot.place_base((0.0, 0.0, 50.0), UPRIGHT)
    robot.push("plate", [10.0, 0.0, 0.0], [0.0] * 3, robot.center_of_mass().tolist())
    run(engine, 1)
    impulse = np.array(robot.base_state().linear)
    run(engine, 1)
    assert impulse[0] == pytest.approx(10.0 * STEP / MASS, rel=1e-3)
    assert robot.base_state().linear[0] == pytest.approx(impulse[0], rel=1e-3)


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
    assert robot.base_state().position[0] == pytest.approx(distance, rel=0.05, abs=1e-3)


def test_what_was_kept_comes_back_to_the_bit(engine):
    robot = load(engine)
    engine.add_plane((0.0, 0.0, 1.0), 1.0)
    robot.place_base((0.0, 0.0, 0.15), UPRIGHT)
    run(engine, 150)
    state = engine.save_state()
    run(engine, 50)
    after = robot.base_state(), robot.joint_states()
    engine.restore_state(state)
    run(engine, 50)
    assert (robot.base_state(), robot.joint_states()) == after
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
