"""Plugins of the simulated CENTAURO that lose their feedback, are put elsewhere, or shall publish nothing."""

import numpy as np
import pytest
import yaml
from support.plugins.plugin import WHEELS, Saboteur, SilentRelay, configuration
from support.plugins.plugin_claims import kill

from solfer.errors import MiddlewareError
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState


def speeds(world):
    """Of the wheels [rad/s]."""
    return world.simulation.v[[world.simulation.kinematics.dofs.index(name) for name in WHEELS]]


def test_damp_relaxes_springs_until_a_reset(world, tmp_path):
    """A plugin turns the wheels, and receives joint states by a relay that falls silent."""
    path = configuration(tmp_path, **{"class": "solfer.components.joint_states:JointStates"})
    tree = yaml.safe_load(path.read_text())
    tree["mwoibn"]["feedback"]["link_side_online"]["on_timeout"] = "damp"
    tree["mwoibn"]["ros"]["feedback"]["link_side_online"]["source"] = SilentRelay.topic
    path.write_text(yaml.safe_dump(tree))
    relay, plugin = SilentRelay(world, "joint_states", "sensor_msgs/JointState"), world.plugin("test", path)
    world.run(0.5)
    assert world.ask("test/trajectory", joints=WHEELS, velocities=(2.0,) * 4).success
    world.run(1.5)
    relay.received = False
    world.run(0.5)
    assert world.simulation.lower_level.emergency and plugin.life is PluginState.STARTING
    relay.received = True
    world.run(0.5)
    assert "emergency stop" in plugin.health()[1]
    world.ask("lower_level/reset_emergency_stop")
    world.run(1.0)
    assert plugin.life is PluginState.RUNNING and np.abs(speeds(world)).max() < 0.05


def test_a_reset_reaches_plugins_that_command_others_only(world):
    """It has no claim to lose, so the reset itself must bring its references to the measured posture, in one step."""
    upper = world.plugin("upper_body")
    world.run(0.5)
    yaw = upper.robot.dof("torso_yaw")
    # no plugin merges, so the robot does not move: the references leave the measured positions
    assert world.ask("upper_body/trajectory", joints=("torso_yaw",), positions=(0.4,), speed=1.0).success
    world.run(1.0)
    assert upper.robot.command.position[yaw] == pytest.approx(0.4)
    queue = MemoryMiddleware(world.bus, "ear").queue("upper_body", "solfer/JointCommand", 1000)
    assert world.ask("simulator/reset").success
    world.run(0.5)
    assert upper.life is PluginState.RUNNING
    assert abs(upper.robot.command.position[yaw] - world.simulation.q[yaw]) < 0.01
    place = queue.drain()
    steps = np.abs(np.diff([message.position[message.names.index("torso_yaw")] for message in place]))
    assert len(place) < 0.45 * upper.rate and np.count_nonzero(steps > 1e-3) == 1  # nothing, then anew


@pytest.mark.daily(1)
@pytest.mark.parametrize(
    "mode, silent, published",
    [
        ("idle", False, [True, False]),
        ("full", False, [True, True]),
        ("full", True, [False, True]),
        ("idle", True, [False, False]),
    ],
)
def test_idle_commands_and_silent_publishes_nothing(world, tmp_path, mode, silent, published):
    ear = MemoryMiddleware(world.bus, "ear")
    queues = [ear.queue(topic, "solfer/JointCommand", 1000) for topic in ("upper_body", "velocity_controller/command")]
    tags = {"class": "support.plugins.plugin:Saboteur", "controller": ["upper_body", "velocity_controller"]}
    plugin = world.plugin("test", configuration(tmp_path, mode=mode, silent=silent, **tags))
    world.run(0.4)
    assert plugin.life is PluginState.RUNNING and plugin.component.cycles > 20
    assert plugin.robot.command.velocity.any()  # all is computed
    assert [bool(queue.drain()) for queue in queues] == published
    assert any(world.ask("lower_level/list_controllers").claimed_by) == (mode == "full")


@pytest.mark.daily(1)
@pytest.mark.parametrize("mode, known", [("full", True), ("idle", True), ("idle", False)])
def test_the_gate_counts_each_kind(world, tmp_path, monkeypatch, mode, known):
    """Also of what is computed only, whether or not there are such controllers."""

    def update(self):
        command = self.model.command
        command.position[self.model.dof("torso_yaw")] = 10.0
        command.torque[[self.model.dof("neck_yaw"), self.model.dof("neck_pitch")]] = -1e4
        command.velocity[[self.model.dof(wheel) for wheel in WHEELS]] = (1.0, 1e3, -1e3, 1e4)
        self.cycles += 1

    monkeypatch.setattr(Saboteur, "update", update)
    monkeypatch.setattr(Saboteur, "send", lambda self: None)
    if not known:

        def no_joints(self, controller, timeout, where=""):
            raise MiddlewareError("no joints are known")

        monkeypatch.setattr(MemoryMiddleware, "controller_joints", no_joints)
    plugin = world.plugin("test", configuration(tmp_path, mode=mode, **{"class": "support.plugins.plugin:Saboteur"}))
    world.run(0.3)
    cycles, figures = plugin.component.cycles, plugin.figures()
    assert cycles > 10
    counts = {key: figures[f"gate: {key}"] for key in ("not finite", "position", "velocity", "effort")}
    assert counts == {"not finite": 0, "position": cycles, "velocity": 3 * cycles, "effort": 2 * cycles}


@pytest.fixture
def shared(world):
    """Fig. 4: two plugins on the parts of the robot, and the one that merges them; all move."""
    plugins = {name: world.plugin(name) for name in ("upper_body", "lower_body", "whole_body")}
    world.run(0.5)
    assert world.ask("upper_body/trajectory", joints=("torso_yaw",), positions=(0.6,), speed=0.3).success
    assert world.ask("lower_body/trajectory", joints=WHEELS, velocities=(1.0, -1.0, 1.0, -1.0)).success
    world.run(1.0)
    assert speeds(world) == pytest.approx([1.0, -1.0, 1.0, -1.0], abs=0.05)
    return plugins


def yaw(world):
    return world.simulation.q[world.simulation.kinematics.dofs.index("torso_yaw")]


def test_wheels_stop_without_the_lower_body(world, shared, caplog):
    kill(shared["lower_body"])
    fastest = 0.0
    for _ in range(200):
        world.run(0.005)
        fastest = max(fastest, np.abs(world.simulation.v[6:]).max())
    assert shared["whole_body"].life is PluginState.STARTING and np.abs(speeds(world)).max() < 0.05
    assert "whole_body holds and waits for feedback 'lower_body' (lower_body)" in caplog.text
    assert fastest < 1.5
    shared["lower_body"].life = PluginState.STARTING  # it is started again
    world.run(1.0)
    assert shared["whole_body"].life is PluginState.RUNNING and np.abs(speeds(world)).max() < 0.05
    assert world.ask("lower_body/trajectory", joints=WHEELS, velocities=(1.0,) * 4).success
    world.run(1.0)
    assert speeds(world) == pytest.approx([1.0] * 4, abs=0.05)
