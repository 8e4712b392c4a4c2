"""Plugins of one process that measure together: each sees what it would see alone, and the work is done once."""

import copy

import numpy as np
import pytest
import yaml
from support.integration.world import CONFIG, World
from support.plugins.plugin import configuration

from solfer.components import Component
from solfer.config import load
from solfer.middleware.memory import MemoryMiddleware
from solfer.model import Kinematics
from solfer.plugins import PluginState, Registry, Sharing, generate

MOTION, WATCHED = {"joints": ("torso_yaw", "j_arm1_4"), "positions": (0.4, -0.6)}, "arm1_7"


class StateWitness(Component):
    """Records the measured State, and where a link is."""

    def init(self):
        self.seen = []

    def update(self):
        state = self.model.state
        place = self.model.kinematics.position(WATCHED)
        self.seen.append((state.position.tobytes(), state.velocity.tobytes(), state.torque.tobytes(), place.tobytes()))


@pytest.fixture
def files(tmp_path):
    """Write a configuration with two witnesses that are alike, and others that are not."""
    path = configuration(tmp_path, mode="idle", kinematics=True)
    tree = yaml.safe_load(path.read_text())
    modules, robots = tree["mwoibn"]["modules"], tree["mwoibn"]["robot"]
    modules["other"], modules["changes"] = copy.deepcopy(modules["test"]), modules["test"] | {"model_change": True}
    robots["tilted"] = copy.deepcopy(robots["joint_space"]) | {"feedback": {"list": ["link_side_online", "imu_base"]}}
    modules["hears_more"] = modules["test"] | {"robot": "tilted"}
    modules["lower"] = modules["test"] | {"secondary_file": {"file": str(CONFIG / "support" / "lower_body.yaml")}}
    path.write_text(yaml.safe_dump(tree))
    return path


class SharedProcess:
    """Plugins that cycle one after the other, in one process; they share their Robots if `together`."""

    def __init__(self, world, path, names, together=True):
        settings = [load(CONFIG / "centauro.yaml" if name == "joint_states" else path, name) for name in names]
        self.world, self.sharing = world, Sharing(settings) if together else None
        self.plugins = [self._made(*each) for each in zip(names, settings, strict=True)]
        world.bus.every(1.0 / self.plugins[0].rate, self.cycle)

    def _made(self, name, settings):
        target = settings.module.class_ if name == "joint_states" else f"{__name__}:StateWitness"
        generator = Registry().find(name, target)
        return generate(settings, MemoryMiddleware(self.world.bus, name), generator, self.sharing)

    def cycle(self):
        if self.sharing is not None:
            self.sharing.turns.next()
        for plugin in self.plugins:
            plugin.cycle()


@pytest.mark.soak
def test_each_sees_bitwise_the_same_as_alone(files):
    runs = []
    for together in (False, True):
        world = World()
        process = SharedProcess(world, files, ("joint_states", "test", "other"), together)
        world.run(0.5)
        assert world.ask(**MOTION).success
        world.run(1.0)
        runs.append([plugin.component.seen for plugin in process.plugins[1:]])
        world.close()
    assert len(runs[0][0]) > 250 and len(set(runs[0][0])) > 200
    assert runs[0] == runs[1] and runs[0][0] == runs[0][1]
    assert process.plugins[1].robot.kinematics is process.plugins[2].robot.kinematics
    assert process.plugins[1].robot.command is not process.plugins[2].robot.command


def test_messages_and_kinematics_are_processed_once(files, world):
    process = SharedProcess(world, files, ("test", "other"))
    world.run(0.2)
    first, second = process.plugins
    pipe, computed = first.feedbacks[0].source.pipe, []
    original = Kinematics.update
    kinematics = first.robot.kinematics
    kinematics.update = lambda *args: computed.append(1) or original(kinematics, *args)
    before = pipe.accepted
    world.run(0.5)
    brought = pipe.accepted - before
    assert brought >= 90 and second.feedbacks[0].source.pipe is pipe
    assert first.feedbacks[0].accepted == second.feedbacks[0].accepted == pipe.accepted
    assert 0 < len(computed) <= sum(feedback.source.pipe.accepted for feedback in first.feedbacks)
    assert len(computed) <= brought + 2


def test_a_stopped_plugin_blocks_no_other(files, world):
    process = SharedProcess(world, files, ("test", "other"))
    world.run(0.2)
    first, second = process.plugins
    first.stop()
    received, seen = second.feedbacks[0].accepted, len(second.component.seen)
    world.run(0.2)
    assert first.life is PluginState.STOPPED and second.life is PluginState.RUNNING
    assert second.feedbacks[0].accepted >= received + 35 and len(second.component.seen) >= seen + 35
    first.restart()
    assert not first.feedbacks[0].received and second.feedbacks[0].received
    world.run(0.05)
    assert first.life is PluginState.RUNNING
    assert first.component.seen[-1] == second.component.seen[-1]


@pytest.mark.parametrize("name", ["changes", "hears_more"])
def test_measurements_of_a_group_are_united(files, world, name):
    process = SharedProcess(world, files, ("test", name))
    world.run(0.2)
    first, second = process.plugins
    assert first.robot.shares_measurement(second.robot)
    assert first.feedbacks[0].source is second.feedbacks[0].source
    turned = [plugin.robot.state.position[3:6] for plugin in process.plugins]
    assert np.array_equal(*turned) and turned[0].any() == (name == "hears_more")


def test_a_different_model_is_not_shared(files, world):
    process = SharedProcess(world, files, ("test", "lower"))
    first, second = (plugin.robot for plugin in process.plugins)
    assert not first.shares_measurement(second) and first.kinematics is not second.kinematics
    second.state.position[:] = 7.0
    assert not np.any(first.state.position == 7.0)
