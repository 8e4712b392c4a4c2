"""Plugins of one process that measure together: each sees what it would see alone, and the work is done once."""

import copy

import numpy as np
import pytest
import yaml
from test_plugin import configuration
from world import CONFIG, World

from solfer.components import Component
from solfer.config import load
from solfer.middleware.memory import MemoryMiddleware
from solfer.model import Description, Kinematics
from solfer.plugins import Life, Registry, Sharing, generate
from solfer.robot import Robot

MOTION, WATCHED = {"joints": ("torso_yaw", "j_arm1_4"), "positions": (0.4, -0.6)}, "arm1_7"


class Witness(Component):
    """Takes down the measured State, and where a link is."""

    def init(self):
        self.seen = []

    def update(self):
        state = self.model.state
        place = self.model.kinematics.position(WATCHED)
        self.seen.append((state.position.tobytes(), state.velocity.tobytes(), state.torque.tobytes(), place.tobytes()))


@pytest.fixture
def files(tmp_path):
    """A configuration with two witnesses that are alike, and others that are not."""
    path = configuration(tmp_path, mode="idle", kinematics=True)
    tree = yaml.safe_load(path.read_text())
    modules, robots = tree["mwoibn"]["modules"], tree["mwoibn"]["robot"]
    modules["other"], modules["changes"] = copy.deepcopy(modules["test"]), modules["test"] | {"model_change": True}
    robots["tilted"] = copy.deepcopy(robots["joint_space"]) | {"feedback": {"list": ["link_side_online", "imu_base"]}}
    modules["hears_more"] = modules["test"] | {"robot": "tilted"}
    path.write_text(yaml.safe_dump(tree))
    return path


class Process:
    """Plugins that cycle one after the other, in one process."""

    def __init__(self, world, path, names, sharing):
        self.world, self.sharing = world, sharing
        self.plugins = [self._made(name, path) for name in names]
        world.bus.every(1.0 / self.plugins[0].rate, self.cycle)

    def _made(self, name, path):
        settings = load(CONFIG / "centauro.yaml" if name == "joint_states" else path, name)
        target = settings.module.class_ if name == "joint_states" else "test_sharing:Witness"
        generator = Registry().find(name, target)
        return generate(settings, MemoryMiddleware(self.world.bus, name), generator, self.sharing)

    def cycle(self):
        if self.sharing is not None:
            self.sharing.turns.next()
        for plugin in self.plugins:
            plugin.cycle()


def test_each_sees_to_the_bit_what_it_would_see_alone(files):
    runs = []
    for sharing in (None, Sharing()):
        world = World()
        process = Process(world, files, ("joint_states", "test", "other"), sharing)
        world.run(0.5)
        assert world.ask(**MOTION).success
        world.run(1.0)
        runs.append([plugin.component.seen for plugin in process.plugins[1:]])
        world.close()
    assert len(runs[0][0]) > 250 and len(set(runs[0][0])) > 200
    assert runs[0] == runs[1] and runs[0][0] == runs[0][1]
    assert process.plugins[1].robot.kinematics is process.plugins[2].robot.kinematics
    assert process.plugins[1].robot.command is not process.plugins[2].robot.command


def test_messages_are_taken_and_kinematics_computed_once(files, world):
    process = Process(world, files, ("test", "other"), Sharing())
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


def test_who_stops_holds_up_nobody_and_begins_anew_with_the_next_message(files, world):
    process = Process(world, files, ("test", "other"), Sharing())
    world.run(0.2)
    first, second = process.plugins
    first.stop()
    heard, seen = second.feedbacks[0].accepted, len(second.component.seen)
    world.run(0.2)
    assert first.life is Life.STOPPED and second.life is Life.RUNNING
    assert second.feedbacks[0].accepted >= heard + 35 and len(second.component.seen) >= seen + 35
    first.restart()
    assert not first.feedbacks[0].heard and second.feedbacks[0].heard
    world.run(0.05)
    assert first.life is Life.RUNNING
    assert first.component.seen[-1] == second.component.seen[-1]


@pytest.mark.parametrize("name", ["changes", "hears_more"])
def test_who_measures_otherwise_measures_alone(files, world, name):
    process = Process(world, files, ("test", name), Sharing())
    world.run(0.2)
    first, second = (plugin.robot for plugin in process.plugins)
    assert first.kinematics is not second.kinematics
    second.state.position[:] = 7.0
    assert not np.any(first.state.position == 7.0)


def test_a_robot_beside_another_computes_what_the_other_has_not(robot_pair):
    one, other = robot_pair
    one.state.position[6:] = 0.3
    assert other.update() and not other.update() and one.update()
    place = one.kinematics.position(WATCHED).copy()
    alone = Kinematics(one.description)
    alone.update(one.state.position, one.state.velocity)
    assert np.array_equal(place, alone.position(WATCHED)) and not one.update()
    versions = one.state.version("position"), other.state.version("position")
    other.command.position[:] = 1.0
    other.state.add("stiffness")
    assert "stiffness" not in one.state and not one.command.position.any()
    assert versions == (one.state.version("position"), other.state.version("position"))


@pytest.fixture
def robot_pair():
    description = Description.from_file(CONFIG / "robots" / "centauro" / "centauro.urdf")
    one = Robot(Kinematics(description))
    return one, Robot(one.kinematics, beside=one)
