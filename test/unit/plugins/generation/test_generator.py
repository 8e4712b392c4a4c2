"""What a plugin is generated with from its configuration: which feedbacks it needs, where its commands begin."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.walk import benches
from support.walk.files import write

from solfer.components.wheeled_motion import WheeledMotion
from solfer.config import load
from solfer.config.loading.configuration import Configuration
from solfer.errors import SolferError, singles
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Registry, generate
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.plugins.generation.generator import log_start
from solfer.plugins.plugin import Plugin, PluginState
from solfer.robot.description.shipped import robot_files

DESIRED = "desired", "sensor_msgs/JointState"
FEEDBACK, CONTROLLER = "feedback/", "controller/"


def made(folder, **changes):
    """Make the walker of the walk's files, with changes by path; return it and those who publish to it."""
    write(folder, changes)
    configuration, others = load(folder / "main.yaml", "sets"), benches.Others(folder)
    generator = Registry().find("sets", configuration.module.class_)
    return generate(configuration, MemoryMiddleware(others.bus, "sets"), generator), others


@pytest.mark.parametrize(("initialize", "required"), [(True, {"joints"}), (False, {"joints", "imu"})])
def test_states_are_required_before_commands(tmp_path, initialize, required):
    """Those that are marked, else all of the link side; motors never are."""
    listening = {"robot/turning/feedback/list": ["joints", "motors", "imu"]}
    chosen = {"modules/sets/robot": "turning", FEEDBACK + "joints/initialize": initialize}
    plugin, _ = made(tmp_path, **listening, **chosen)
    assert {pipe.name for pipe in plugin.feedbacks if pipe.required} == required


def test_commands_begin_at_what_is_measured(tmp_path):
    plugin, others = made(tmp_path, **{FEEDBACK + "joints/filter": None, CONTROLLER + "arm_controller/filter": None})
    sent, k = MemoryMiddleware(others.bus, "ear").queue("arm_controller/command", "solfer/JointCommand"), 1
    while not (messages := sent.drain()):
        k += 1
        assert k < benches.CYCLES
        others.bus.run_until(others.bus.time + 1.0 / plugin.rate)
        others.publish(k)
        plugin.cycle()
    places = [plugin.robot.dof(name) for name in messages[0].names]
    for commanded, state in ((messages[0].position, "position"), (messages[0].effort, "torque")):
        measured = plugin.robot.state[state][places]
        assert measured.any()
        np.testing.assert_array_equal(commanded, measured)


def test_an_idle_plugin_publishes_and_commands_nothing(tmp_path):
    pipes = {"modules/sets/controller": ["arm_controller", "desired"]}
    plugin, others = made(tmp_path, **{"modules/sets/mode": "idle"}, **pipes)
    ear = MemoryMiddleware(others.bus, "ear")
    commands, desired = (ear.queue(*end) for end in (("arm_controller/command", "solfer/JointCommand"), DESIRED))
    for k in range(1, 30):
        others.bus.run_until(others.bus.time + 1.0 / plugin.rate)
        others.publish(k)
        plugin.cycle()
    assert plugin.life is PluginState.RUNNING and not commands.drain() and plugin.outputs.commanding == ()
    assert desired.drain()


def test_warnings_of_tags_are_logged_at_the_start(repository, monkeypatch, caplog):
    configuration = load(repository / "config/centauro.yaml", "wheeled_motion")
    component = WheeledMotion.__new__(WheeledMotion)
    log_start(configuration, SimpleNamespace(component=component))
    assert not caplog.messages

    def read_tags(own, record, problems):
        problems.warn(own.module.place(), f"a tag of {record.__name__} is no more")

    monkeypatch.setattr(Configuration, "read_tags", read_tags)
    log_start(configuration, SimpleNamespace(component=component))
    assert re.search(r"centauro.yaml:\d+:\d+: .* a tag of WheeledMotionTags is no more", caplog.text)


def test_a_check_finds_what_a_start_refuses(repository, monkeypatch):
    """Both generate in one way: what a start raises the check returns, and it releases what it could make."""
    configuration = load(repository / "config/centauro.yaml", "joint_states")
    files = robot_files(configuration)
    generator = Registry().find("joint_states")
    released = []
    monkeypatch.setattr(Plugin, "close", lambda plugin: released.append(plugin.component.name))
    outside = DryMiddleware(configuration, files)
    assert generator(outside.configuration, outside).check() == [] and released == ["joint_states"]
    blind = replace(configuration, feedbacks=())
    with pytest.raises(SolferError, match="commands a robot but receives no state of it") as refused:
        generate(blind, DryMiddleware(blind, files), generator)
    faults = generator(blind, DryMiddleware(blind, files)).check()
    assert list(map(str, faults)) == list(map(str, singles([refused.value]))) and len(released) == 1


@pytest.mark.slow
def test_who_hears_of_a_plugin_is_looked_for(tmp_path, caplog):
    plugin, others = made(tmp_path, **{"modules/sets/controller": ["arm_controller", "desired"]})
    for k in range(1, 80):
        others.bus.run_until(others.bus.time + 0.1)
        others.publish(k)
        plugin.cycle()
        plugin.peers.look()
    (explanation,) = [text for text in caplog.messages if "no subscriber" in text]
    assert (
        explanation.startswith("sets: no subscriber on desired (controller 'desired', ") and "main.yaml:" in explanation
    )


def test_documents_of_a_run_are_those_of_its_robot(tmp_path):
    plugin, _ = made(tmp_path)
    kept = plugin.documents()
    assert sorted(kept.files) == ["configuration.yaml", "robot.srdf", "robot.urdf"]
    assert kept.files["robot.srdf"] == plugin.robot.semantics.text
    assert set(kept.texts) == {"sets/tags"}
