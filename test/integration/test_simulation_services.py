"""Services of the simulator, next to a plugin that runs."""

import time

import numpy as np
import pytest
from matplotlib.image import imread
from world import World

from solfer.errors import UnknownName
from solfer.pipes.messages import JointMessage

WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")
NAN = float("nan")


def ask(world, service, **fields):
    """The reply of a service of the simulator."""
    return world.ask(f"simulator/{service}", **fields)


def test_a_reset_puts_the_robot_anywhere_and_time_goes_on(world):
    plugin = world.plugin("joint_states")
    world.run(0.5)
    begin = world.simulation.time
    stamps = []
    world.bus.topic("joint_states", "sensor_msgs/JointState").listeners.append(
        lambda message: stamps.append(message.stamp))
    reply = ask(world, "reset", state="mammal_wide_high", seed=5, x=1.0, yaw=0.5, height=0.05)
    assert reply.success, reply.message
    assert world.simulation.time == pytest.approx(begin + 0.02)
    assert world.simulation.body.position[0] == pytest.approx(1.0, abs=0.01)
    assert world.simulation.contact_links() == ()
    world.run(2.0)
    assert world.simulation.contact_links() == WHEELS
    assert (np.diff(stamps) > 0.0).all() and len(stamps) > 400
    assert plugin.life.value == "running"


def test_a_reset_forgets_commands_and_pushes(world):
    world.run(0.1)
    controller = world.simulation.lower_level.controller("velocity_controller")
    lower_level = world.simulation.lower_level
    lower_level.accept("velocity_controller", JointMessage(controller.joints, velocity=np.ones(4), sender="somebody"))
    assert lower_level.claims.owners() == ("somebody",)
    assert ask(world, "push", link="pelvis", force=(0.0, 500.0, 0.0), duration=5.0).success
    assert ask(world, "reset").success
    assert not controller.velocity.any()
    assert lower_level.claims.owners() == ()
    world.run(0.5)
    assert abs(world.simulation.body.position[1]) < 2e-3


def test_a_pause_ages_nothing_and_nobody_takes_the_robot_for_dead(world):
    plugin = world.plugin("joint_states")
    world.run(0.5)
    assert world.ask(joints=("torso_yaw",), positions=(0.4,), speed=0.2).success
    world.run(0.3)
    assert ask(world, "pause", data=True).success
    begin, q = world.simulation.time, world.simulation.q.copy()
    world.run(3.0)
    assert world.simulation.time == begin
    np.testing.assert_array_equal(world.simulation.q, q)
    assert plugin.life.value == "running"
    assert world.bus.reports["simulation"].summary == "paused"
    assert ask(world, "pause", data=False).success
    world.run(3.0)
    assert plugin.life.value == "running"
    yaw = world.simulation.kinematics.dofs.index("torso_yaw")
    assert world.simulation.q[yaw] == pytest.approx(0.4, abs=0.01)


def test_a_velocity_does_not_expire_in_a_pause(world):
    world.run(0.1)
    wheels = world.simulation.lower_level.controller("velocity_controller")
    wheels.accept(JointMessage(wheels.joints, velocity=np.ones(4)))
    assert ask(world, "pause", data=True).success
    world.run(3.0)
    assert wheels.velocity.all()
    assert ask(world, "pause", data=False).success
    world.run(0.4)
    assert wheels.velocity.all()
    world.run(0.2)
    assert not wheels.velocity.any()


def test_steps_advance_a_paused_simulation_by_exactly_that_many(world):
    world.run(0.1)
    assert "not paused" in ask(world, "step", count=1).message
    ask(world, "pause", data=True)
    for count in (1, 7, 250):
        before = world.simulation.count
        assert ask(world, "step", count=count).success
        assert world.simulation.count - before == count
    for wrong in (0, -3, 10**9):
        before = world.simulation.count
        assert not ask(world, "step", count=wrong).success
        assert world.simulation.count == before


def test_a_push_moves_the_robot_and_it_comes_back(world):
    world.run(0.5)
    before = world.simulation.body.position.copy()
    assert ask(world, "push", link="torso_2", force=(0.0, 150.0, 0.0), duration=0.3).success
    world.run(0.1)
    assert world.simulation.body.position[1] - before[1] > 1e-3
    world.run(3.0)
    assert np.abs(world.simulation.body.position - before).max() < 0.02
    assert world.simulation.contact_links() == WHEELS


@pytest.mark.parametrize(
    ("service", "fields", "says"),
    [
        ("push", {"link": "torso_3", "force": (1.0, 0.0, 0.0), "duration": 1.0}, "torso_2"),
        ("push", {"link": "torso_2", "force": (NAN, 0.0, 0.0), "duration": 1.0}, "force"),
        ("push", {"link": "torso_2", "torque": (0.0, float("inf"), 0.0), "duration": 1.0}, "torque"),
        ("push", {"link": "torso_2", "duration": -1.0}, "duration"),
        ("push", {"link": "torso_2", "duration": NAN}, "duration"),
        ("reset", {"state": "mammal_wide_hig"}, "mammal_wide_high"),
        ("reset", {"height": -0.1}, "height"),
        ("reset", {"x": NAN}, "'x'"),
        ("reset", {"seed": -1}, "seed"),
        ("set_friction", {"surface": "grund", "coefficient": 0.5}, "ground"),
        ("set_friction", {"surface": "ground", "coefficient": NAN}, "friction"),
        ("set_friction", {"surface": "wheels", "coefficient": -1.0}, "friction"),
    ],
)
def test_a_wrong_request_is_refused_and_changes_nothing(idle, service, fields, says):
    before = idle.simulation.q.copy()
    reply = ask(idle, service, **fields)
    assert not reply.success
    assert says in reply.message
    np.testing.assert_allclose(idle.simulation.q, before, atol=1e-3)


def test_friction_of_the_wheels_decides_whether_it_drives(world):
    for coefficient, moves in ((0.0, False), (0.8, True)):
        assert ask(world, "set_friction", surface="wheels", coefficient=coefficient).success
        assert ask(world, "reset").success
        world.run(0.2)
        begin = world.simulation.body.position.copy()
        wheels = world.simulation.lower_level.controller("velocity_controller")
        wheels.accept(JointMessage(wheels.joints, velocity=np.array([1.0, -1.0, 1.0, -1.0])))
        world.run(0.5)
        assert (np.linalg.norm((world.simulation.body.position - begin)[:2]) > 0.02) == moves


def test_a_service_that_there_is_not(world):
    with pytest.raises(UnknownName, match="simulator/rest"):
        world.bus.call("simulator/rest")


def photograph(world, path):
    """The reply of the screenshot service; the simulation goes on meanwhile."""
    reply = world.bus.call("simulator/screenshot", path=str(path))
    before, end = world.simulation.count, time.monotonic() + 60.0
    while not reply.done() and time.monotonic() < end:
        world.run(0.01)
        time.sleep(0.001)
    assert world.simulation.count > before
    return reply.result(0)


def test_a_screenshot_shows_the_robot(idle, tmp_path):
    reply = photograph(idle, tmp_path / "robot.png")
    assert reply.success, reply.message
    picture = 255 * imread(tmp_path / "robot.png")
    assert picture.shape[:2] == (720, 960)
    red, green, blue = np.moveaxis(picture[:, :, :3], 2, 0)
    assert 0.01 < ((red > green + 60) & (green > blue + 20)).mean() < 0.5  # its orange covers
    for wrong, says in (("robot.png", "absolute"), (tmp_path / "robot.jpg", ".png"),
                        (tmp_path / "missing" / "robot.png", "cannot be written")):
        reply = photograph(idle, wrong)
        assert not reply.success and says in reply.message


@pytest.fixture(scope="module")
def idle():
    """A world that nobody disturbs."""
    world = World()
    world.run(0.3)
    yield world
    world.close()
