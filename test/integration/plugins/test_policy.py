"""A policy as a plugin on the simulated CENTAURO: it stands, and where it must not go on the robot is held."""

from contextlib import closing

import numpy as np
import pytest
import yaml
from support.integration.world import CONFIG, World
from support.plugins.plugin import SilentRelay
from support.plugins.policies import POLICY, TERMS, file_of, legs
from support.recording.sine import taped

from solfer.config import load
from solfer.errors import SolferError
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState, Registry, generate
from solfer.recording.reader import read
from solfer.transport.messages import FieldsMessage
from solfer_tools.cli.main import main as solfer

pytest.importorskip("onnxruntime", reason="needs pip install -r requirements-policy.txt")

SPRINGS = {"file": str(CONFIG / "support/springs.yaml")}


def test_zero_actions_keep_the_robot_standing(tmp_path):
    """It runs 50 times a second in a loop of 200 Hz, with gains of its own, and the base stays where it is."""
    tags = {"gains": {"stiffness": dict.fromkeys(legs(), 2000.0), "damping": 50.0}, "secondary_file": SPRINGS}
    with closing(World()) as world:
        plugin = world.plugin("test", file_of(tmp_path, **tags), POLICY)
        world.run(0.5)
        component = plugin.component
        before = component.steps
        start = world.simulation.body.position.copy()
        world.run(1.0)
        assert plugin.life is PluginState.RUNNING and not component.fault
        assert component.steps - before == pytest.approx(50, abs=1)
        assert np.abs(world.simulation.body.position - start).max() < 0.02
        dofs = component.contract.dofs
        assert np.array_equal(plugin.robot.command.position[dofs], component.contract.default)
        assert (plugin.robot.command["stiffness"][dofs] == 2000.0).all()
        assert len(world.simulation.contact_links()) == 4


@pytest.mark.soak
def test_a_posture_far_from_the_default_is_held(tmp_path, caplog):
    """With the gains that the lower level had before."""
    tags = {"default": legs() | {"torso_yaw": 1.0}, "gains": {"stiffness": 5.0}, "secondary_file": SPRINGS}
    with closing(World()) as world:
        plugin = world.plugin("test", file_of(tmp_path, **tags), POLICY)
        world.run(0.5)
        start = world.simulation.q.copy()
        world.run(1.0)
        assert "'torso_yaw' is -1.0" in caplog.text and caplog.text.count("holds until") == 1
        assert np.abs(world.simulation.q - start).max() < 2e-3 and not plugin.component.steps
        assert plugin.robot.command["stiffness"][plugin.robot.dof("torso_yaw")] == 5000.0


@pytest.mark.soak
def test_no_number_of_the_network_holds(tmp_path, caplog):
    with closing(World()) as world:
        plugin = world.plugin("test", file_of(tmp_path, offset=np.nan), POLICY)
        world.run(1.5)
        assert plugin.life is PluginState.RUNNING and "is not finite" in plugin.component.fault
        assert caplog.text.count("holds until") == 1 and len(world.simulation.contact_links()) == 4


def test_gains_that_no_controller_carries_are_refused(tmp_path):
    file = file_of(tmp_path, gains={"stiffness": 100.0})
    with closing(World()) as world, pytest.raises(SolferError, match="stiffness"):
        generate(load(file, "test"), MemoryMiddleware(world.bus, "test"), Registry().find("test", POLICY))


def test_a_base_that_nothing_measures_is_refused(tmp_path):
    """It would count as upright and at rest."""
    file = file_of(tmp_path, robot="joint_space")
    with closing(World()) as world, pytest.raises(SolferError, match="no feedback measures it"):
        generate(load(file, "test"), MemoryMiddleware(world.bus, "test"), Registry().find("test", POLICY))


def test_a_message_commands_the_base(tmp_path):
    """What is published on `<name>/cmd_vel` is observed, and half a second after the last message it is zero."""
    with closing(World()) as world:
        component = world.plugin("test", file_of(tmp_path), POLICY).component
        writer = MemoryMiddleware(world.bus, "driver").writer("test/cmd_vel", "geometry_msgs/Twist")
        world.run(0.2)
        writer.write(FieldsMessage({"linear": {"x": 0.2, "y": 0.05}, "angular": {"z": 0.1}}))
        world.run(0.1)
        observed = component.network.observations[6:9]
        assert observed == pytest.approx((0.2, 0.05, 0.1))
        world.run(0.35)
        assert observed.any()
        world.run(0.15)
        assert not observed.any()


def test_a_command_of_nan_is_refused_once(tmp_path, caplog):
    """The log has one warning of ten messages, and the robot goes on."""
    with closing(World()) as world:
        component = world.plugin("test", file_of(tmp_path), POLICY).component
        writer = MemoryMiddleware(world.bus, "driver").writer("test/cmd_vel", "geometry_msgs/Twist")
        world.run(0.2)
        for _ in range(10):
            writer.write(FieldsMessage({"linear": {"x": np.nan}}))
            world.run(0.02)
        assert not component.network.observations[6:9].any() and not component.fault and component.steps > 15
        (record,) = (each for each in caplog.records if "cmd_vel" in each.message)
        assert record.levelname == "WARNING" and "nan" in record.message


def test_an_imu_that_is_silent_holds(tmp_path):
    """The timeout of its feedback holds the plugin, though joints are measured; then the component begins again."""
    file = file_of(tmp_path)
    tree = yaml.safe_load(file.read_text())
    tree["mwoibn"]["ros"]["feedback"]["imu_base"]["source"] = SilentRelay.topic
    file.write_text(yaml.safe_dump(tree))
    with closing(World()) as world:
        relay = SilentRelay(world, "imu", "sensor_msgs/Imu")
        plugin = world.plugin("test", file, POLICY)
        check_silence(world, plugin, lambda: setattr(relay, "received", False))
        relay.received = True
        world.run(0.5)
        assert plugin.life is PluginState.RUNNING and 0 < plugin.component.steps <= 26


def test_an_odometry_that_is_silent_holds(tmp_path):
    """That of the linear velocity, which no sensor measures."""
    with closing(World()) as world:
        world.plugin("odometry", target="solfer.components.odometry:Odometry")
        terms = [{"term": term} for term in ("linear_velocity", *TERMS[1:])]
        file = file_of(tmp_path, robot="located", observations=terms)
        check_silence(world, world.plugin("test", file, POLICY), lambda: world.asleep.add("odometry"))


def check_silence(world, plugin, silence):
    """Check that a plugin runs, and that 0.3 s of silence hold it."""
    world.run(0.6)
    assert plugin.life is PluginState.RUNNING and plugin.component.steps > 5
    silence()
    world.run(0.1)
    assert plugin.life is PluginState.RUNNING
    world.run(0.2)
    assert plugin.life is PluginState.STARTING and not plugin.component.steps


def test_a_replay_has_the_actions(tmp_path, capsys):
    """Position commands are the default pose and the scaled action; another network's are others."""
    weights = np.random.default_rng(1).normal(scale=0.02, size=(9 + 3 * len(legs()), len(legs())))
    with closing(World()) as world:
        plugin = world.plugin("test", file_of(tmp_path, weights), POLICY)
        world.asleep.add("test")
        driver = MemoryMiddleware(world.bus, "driver").writer("test/cmd_vel", "geometry_msgs/Twist")

        def step(cycle):
            world.run(1.0 / plugin.rate)
            if cycle == 100:
                driver.write(FieldsMessage({"linear": {"x": 0.2}}))

        file = taped(tmp_path, plugin, world.bus, step, cycles=200)
    actions = read(file)["test/log/action"].values
    assert np.ptp(actions, axis=0).min() > 0.01
    assert solfer(["replay", str(file), "-n", "test"]) == 0
    assert "the same commands, to 0" in capsys.readouterr().out
    file_of(tmp_path, weights + 1e-4)
    assert solfer(["replay", str(file), "-n", "test"]) == 1


@pytest.mark.parametrize(
    ("command", "tags", "code", "said"),
    [
        ("0 0 0", {}, 0, ""),
        ("0.5 0 0", {}, 2, "a velocity of 0.5 is commanded, and the one that is reached is wrong by 0.50"),
        ("0 0 0.5", {"default": {"torso_yaw": 1.0}}, 2, "'torso_yaw' is -1.000 from the default pose"),
    ],
)
def test_a_rollout_finds_what_does_not_walk(tmp_path, capsys, command, tags, code, said):
    """The check simulates the plugin: a network of zeros stands, and does not reach a velocity."""
    tags = {key: legs() | value for key, value in tags.items()}
    gains = {"stiffness": dict.fromkeys(legs(), 2000.0), "damping": 50.0}
    file = file_of(tmp_path, gains=gains, secondary_file=SPRINGS, **tags)
    words = f"policy check {file} -n test --robot centauro --rollout 2 --command {command}"
    assert solfer(words.split()) == code
    printed = capsys.readouterr()
    assert said in printed.err and ("Traceback" not in printed.err)
    rows = [line.split() for line in printed.out.splitlines() if line.startswith(command)]
    assert len(rows) == (0 if tags else 2)
    assert np.abs(np.array([row[3:] for row in rows], dtype=float)).max(initial=0.0) < 0.02
