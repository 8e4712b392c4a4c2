"""Services of the simulator, next to a plugin that runs."""

import os
import time

import numpy as np
import pytest
from matplotlib.image import imread
from support.bullet import raw_bullet
from support.controllers import accept
from support.integration.world import World

from solfer.errors import SimulationError, UnknownName
from solfer.plugins import PluginState
from solfer.transport.messages import JointMessage

WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")
NAN = float("nan")


def ask(world, service, **fields):
    """Return the reply of a service of the simulator."""
    return world.ask(f"simulator/{service}", **fields)


def test_a_reset_moves_robots_and_not_time(world):
    """The robot drops from its new pose while stamps go on rising, so a running plugin sees no time go back."""
    plugin = world.plugin("joint_states")
    world.run(0.5)
    begin = world.simulation.time
    stamps = []
    world.bus.topic("joint_states", "sensor_msgs/JointState").listeners.append(
        lambda message: stamps.append(message.stamp)
    )
    reply = ask(world, "reset", state="mammal_wide_high", seed=5, x=1.0, yaw=0.5, height=0.05)
    assert reply.success, reply.message
    assert world.simulation.time == pytest.approx(begin + 0.02)
    assert world.simulation.body.position[0] == pytest.approx(1.0, abs=0.01)
    assert world.simulation.contact_links() == ()
    world.run(2.0)
    assert world.simulation.contact_links() == WHEELS
    assert (np.diff(stamps) > 0.0).all() and len(stamps) > 400
    assert plugin.life is PluginState.RUNNING


def test_a_reset_forgets_commands_and_pushes(world):
    world.run(0.1)
    controller = world.simulation.lower_level.controller("velocity_controller")
    lower_level = world.simulation.lower_level
    lower_level.accept("velocity_controller", JointMessage(controller.joints, velocity=np.ones(4), sender="owner"))
    assert lower_level.claims.owners() == ("owner",)
    assert ask(world, "push", link="pelvis", force=(0.0, 500.0, 0.0), duration=5.0).success
    world.run(0.1)
    assert world.simulation.body.position[1] > 5e-3
    assert ask(world, "reset").success
    assert not controller.velocity.any()
    assert lower_level.claims.owners() == ()
    world.run(0.5)
    assert abs(world.simulation.body.position[1]) < 2e-3


def test_nothing_ages_in_a_pause(world):
    """Three seconds of pause change neither state nor age of messages, and the motion ends at its goal afterwards."""
    plugin = world.plugin("joint_states")
    world.run(0.5)
    assert world.ask(joints=("torso_yaw",), positions=(0.4,), speed=0.2).success
    world.run(0.3)
    assert ask(world, "pause", data=True).success
    begin, q = world.simulation.time, world.simulation.q.copy()
    world.run(3.0)
    assert world.simulation.time == begin
    np.testing.assert_array_equal(world.simulation.q, q)
    assert plugin.life is PluginState.RUNNING
    assert world.bus.reports["simulation"].summary == "paused"
    assert ask(world, "pause", data=False).success
    world.run(3.0)
    assert plugin.life is PluginState.RUNNING
    yaw = world.simulation.kinematics.dofs.index("torso_yaw")
    assert world.simulation.q[yaw] == pytest.approx(0.4, abs=0.01)


def test_a_velocity_does_not_expire_in_a_pause(world):
    world.run(0.1)
    wheels = world.simulation.lower_level.controller("velocity_controller")
    accept(wheels, JointMessage(wheels.joints, velocity=np.ones(4)))
    assert ask(world, "pause", data=True).success
    world.run(3.0)
    assert wheels.velocity.all()
    assert ask(world, "pause", data=False).success
    world.run(0.4)
    assert wheels.velocity.all()
    world.run(0.2)
    assert not wheels.velocity.any()


def test_steps_advance_a_paused_simulation_exactly(world):
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


@pytest.mark.parametrize(
    ("service", "fields", "error"),
    [
        ("push", {"link": "torso_3", "force": (1.0, 0.0, 0.0), "duration": 1.0}, "torso_2"),
        ("push", {"link": "torso_2", "force": (NAN, 0.0, 0.0), "duration": 1.0}, "force"),
        ("push", {"link": "torso_2", "torque": (0.0, float("inf"), 0.0), "duration": 1.0}, "torque"),
        ("push", {"link": "torso_2", "force": (1e300, 0.0, 0.0), "duration": 1.0}, "from -10000 to 10000 [N]"),
        ("push", {"link": "torso_2", "torque": (0.0, 0.0, -1.1e4), "duration": 1.0}, "from -10000 to 10000 [Nm]"),
        ("push", {"link": "torso_2", "force": (1.0,), "duration": 1.0}, "three numbers"),
        ("push", {"link": "torso_2", "duration": 1e300}, "to 60 [s]"),
        ("push", {"link": "torso_2", "duration": -1.0}, "duration"),
        ("push", {"link": "torso_2", "duration": NAN}, "duration"),
        ("reset", {"state": "mammal_wide_hig"}, "mammal_wide_high"),
        ("reset", {"height": -0.1}, "height"),
        ("reset", {"height": 1e300}, "from 0 to 100 [m]"),
        ("reset", {"x": NAN}, "'x'"),
        ("reset", {"x": 1e300}, "from -1000 to 1000 [m]"),
        ("reset", {"y": -1001.0}, "from -1000 to 1000 [m]"),
        ("reset", {"yaw": 1e300}, "from -100 to 100 [rad]"),
        ("reset", {"state": 1_000_000 * "s"}, "unknown state"),
        ("reset", {"seed": -1}, "seed"),
        ("reset", {"seed": 2**63}, "seed"),
        ("set_friction", {"surface": "grund", "coefficient": 0.5}, "ground"),
        ("set_friction", {"surface": "ground", "coefficient": NAN}, "friction"),
        ("set_friction", {"surface": "wheels", "coefficient": -1.0}, "friction"),
        ("set_friction", {"surface": "wheels", "coefficient": 1e300}, "from 0 to 10"),
        ("set_drive", {"joint": "j_wheel_5", "state": "free"}, "j_wheel_4"),
        ("set_drive", {"joint": "j_wheel_1", "state": "broken"}, "sound"),
    ],
)
def test_a_wrong_request_is_refused_and_changes_nothing(idle, service, fields, error):
    before = idle.simulation.q.copy()
    reply = ask(idle, service, **fields)
    assert not reply.success
    assert error in reply.message
    np.testing.assert_allclose(idle.simulation.q, before, atol=1e-3)


def test_friction_of_the_wheels_decides_whether_it_drives(world):
    for coefficient, moves in ((0.0, False), (0.8, True)):
        assert ask(world, "set_friction", surface="wheels", coefficient=coefficient).success
        assert ask(world, "reset").success
        world.run(0.2)
        begin = world.simulation.body.position.copy()
        wheels = world.simulation.lower_level.controller("velocity_controller")
        accept(wheels, JointMessage(wheels.joints, velocity=np.array([1.0, -1.0, 1.0, -1.0])))
        world.run(0.5)
        assert (np.linalg.norm((world.simulation.body.position - begin)[:2]) > 0.02) == moves


def test_a_service_that_there_is_not(world):
    with pytest.raises(UnknownName, match="simulator/rest"):
        world.bus.call("simulator/rest")


def photograph(world, path):
    """Return the reply of the screenshot service; the simulation goes on meanwhile."""
    reply = world.bus.call("simulator/screenshot", path=str(path))
    before, end = world.simulation.count, time.monotonic() + 60.0
    while not reply.done() and time.monotonic() < end:
        world.run(0.01)
        time.sleep(0.001)
    assert world.simulation.count > before
    return reply.result(0)


def test_a_robot_that_cannot_be_put_stays(world, monkeypatch):
    world.run(0.1)
    lower_level = world.simulation.lower_level
    wheels = lower_level.controller("velocity_controller").joints
    lower_level.accept("velocity_controller", JointMessage(wheels, velocity=np.ones(4), sender="owner"))
    world.run(0.05)
    before, speed = world.simulation.q.copy(), np.abs(world.simulation.v).max()
    monkeypatch.setattr("solfer.simulation.robot_body.body.Body.distance", lambda *_: 1.0)  # it never touches
    reply = world.bus.call("simulator/reset", x=3.0)
    world.run(0.001)
    assert "no place" in reply.result(0).message
    assert np.abs(world.simulation.q - before).max() < 0.005 and speed > 0.5
    assert np.abs(world.simulation.v).max() > 0.5  # it drives on
    assert lower_level.claims.owners() == ("owner",)


def diverge(world):
    """Let the numbers of the world be none any more."""
    bullet = raw_bullet(world.simulation)
    bullet.module.resetBaseVelocity(bullet.body, [NAN] * 3, [0.0] * 3, bullet.client)


def test_a_diverged_simulation_begins_anew(world, caplog):
    """The restart ends all claims, and the plugin resumes from zero without the motion that was requested before."""
    plugin = world.plugin("joint_states")
    world.run(0.5)
    assert world.ask(joints=("torso_yaw",), positions=(0.4,), speed=0.2).success
    world.run(1.0)
    start = world.simulation.lower_level.starts
    diverge(world)
    world.run(0.001)
    lower_level = world.simulation.lower_level
    assert lower_level.starts == start + 1 and not lower_level.claims.owners()
    assert np.isfinite(world.simulation.q).all() and not world.simulation.v.any()
    assert "diverged" in caplog.text
    world.run(1.5)
    assert plugin.life is PluginState.RUNNING
    yaw = world.simulation.kinematics.dofs.index("torso_yaw")
    assert abs(world.simulation.q[yaw]) < 0.01  # what was asked for is forgotten


def test_a_simulation_that_diverges_at_once_again_ends(world):
    world.run(0.1)
    diverge(world)
    world.run(0.101)
    after = world.simulation.q.copy()
    world.simulation.reset()
    world.run(0.1)
    np.testing.assert_array_equal(world.simulation.q, after)
    diverge(world)
    with pytest.raises(SimulationError, match="diverged"):
        world.run(0.01)


@pytest.fixture()
def pictures(monkeypatch, tmp_path):
    """Return the folder of pictures, not yet made."""
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    return tmp_path / "solfer" / "pictures"


def test_a_screenshot_is_written_into_its_folder_only(world, pictures, tmp_path):
    """A service that any node can call must not overwrite files: foreign paths get one refusal, and nothing changes."""
    victim = tmp_path / "victim.png"
    victim.write_text("mine")
    answers = set()
    for path in (
        victim,
        tmp_path / "missing.png",
        f"{pictures}/../victim.png",
        "../victim.png",
        "robot.jpg",
        ".png",
        "a/b.png",
        "robot.png\0",
        "",
        300 * "r" + ".png",
    ):
        reply = world.bus.call("simulator/screenshot", path=str(path))
        while not reply.done():
            world.run(0.01)
        assert not reply.result(0).success
        answers.add(reply.result(0).message.partition(" cannot become a picture")[2])
    assert len(answers) == 1 and "folder of pictures" in answers.pop()
    assert victim.read_text() == "mine" and not pictures.exists()


def test_a_screenshot_shows_the_robot(idle, pictures, tmp_path):
    pictures.mkdir(parents=True, mode=0o700)
    (tmp_path / "victim").write_text("mine")
    (pictures / "robot.png").symlink_to(tmp_path / "victim")
    reply = photograph(idle, "robot.png")
    assert reply.success and reply.message == str(pictures / "robot.png"), reply.message
    assert (tmp_path / "victim").read_text() == "mine"
    assert os.listdir(pictures) == ["robot.png"] and not (pictures / "robot.png").is_symlink()
    picture = 255 * imread(pictures / "robot.png")
    assert picture.shape[:2] == (720, 960)
    red, green, blue = np.moveaxis(picture[:, :, :3], 2, 0)
    assert 0.01 < ((red > green + 60) & (green > blue + 20)).mean() < 0.5  # its orange covers
    pictures.chmod(0o777)
    reply = photograph(idle, pictures / "robot.png")
    assert not reply.success and "not the user's own" in reply.message


@pytest.fixture(scope="module")
def idle():
    """Run a world without disturbances."""
    world = World()
    world.run(0.9)  # joints settle on their springs
    yield world
    world.close()
