"""The examples of docs/explanation/shared_plugin.md run, and the programs of pages that have no test of their own."""

import copy
import re
import sys
import textwrap
from types import ModuleType

import numpy as np
import pytest
import yaml
from support.integration.world import CONFIG, World
from support.plugins.fleet import tree
from support.unit.cart import URDF

from solfer.config import load_shared
from solfer.config.loading.rt_layer import read_layer
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Generator, PluginState, Registry, generate_shared
from solfer_tools.cli.main import main

FORCE = "geometry_msgs/Vector3Stamped"


class ListeningGenerator(Generator):
    """Receives what the page's component publishes."""

    def init_callbacks(self, component):
        """Make the pipe."""
        super().init_callbacks(component)
        component.received = self.middleware.reader("first/push", FORCE)


@pytest.fixture(scope="module")
def page(repository):
    return (repository / "docs/explanation/shared_plugin.md").read_text()


@pytest.fixture
def folder(page, repository, tmp_path, monkeypatch):
    """Make the working directory: the shipped files with the page's module and its real-time layer."""
    module, layer = blocks(page, "yaml")
    (tmp_path / "config").mkdir()
    for name in ("support", "robots"):
        (tmp_path / "config" / name).symlink_to(CONFIG / name)
    text = (CONFIG / "centauro.yaml").read_text()
    assert "\n  modules:\n" in text
    text = text.replace("\n  modules:\n", f"\n  modules:\n{textwrap.indent(module, '    ')}")
    (tmp_path / "config" / "centauro.yaml").write_text(text)
    (tmp_path / "config" / "layer.yaml").write_text(layer)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def blocks(page, language):
    return re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["reference/dynamics.md", "explanation/transport_faults.md"])
def test_the_program_of_another_page_runs(repository, monkeypatch, name):
    monkeypatch.chdir(repository)
    (program,) = blocks((repository / "docs" / name).read_text(), "python")
    exec(compile(program, name, "exec"), {})


@pytest.mark.slow
def test_its_configuration_has_no_mistakes(folder, capsys):
    assert main(["check", "config/centauro.yaml", "-n", "shared_control"]) == 0
    assert main(["check", "config/layer.yaml"]) == 0
    assert main(["graph", "config/centauro.yaml", "-n", "shared_control"]) == 0
    out, err = capsys.readouterr()
    assert "error" not in err and "shared_control" in out


def test_its_layer_expands_the_shared_plugin(folder):
    layer = read_layer("config/layer.yaml")
    assert [each.name for each in layer.plugins] == ["joint_states", "upper_body", "lower_body", "whole_body"]
    assert layer.start == ("upper_body", "lower_body", "whole_body")


@pytest.mark.slow
def test_its_program_moves_both_parts(folder, page, monkeypatch):
    """The page's program runs as printed: both parts move the simulated robot, and the merge takes no extra cycle."""
    world = World()
    monkeypatch.setattr("solfer.middleware.memory.Bus", lambda parameters: world.bus)
    scope = {}
    exec(blocks(page, "python")[0], scope)
    together = scope["together"]
    together.start()
    world.bus.every(1.0 / together.rate, together.cycle)
    try:
        world.run(0.6)
        assert [managed.state for managed in together.plugins] == [PluginState.RUNNING] * 3
        for service, joint in (("upper_body", "torso_yaw"), ("lower_body", "ankle_yaw_1")):
            reply = world.ask(f"{service}/trajectory", joints=(joint,), positions=(0.15,), speed=0.5)
            assert reply.success, reply.message
        world.run(1.2)
        upper, lower, whole = (managed.plugin.robot for managed in together.plugins)
        for part, joint in ((upper, "torso_yaw"), (lower, "ankle_yaw_1")):
            desired = part.command.position[part.dof(joint)]
            assert abs(desired - 0.15) < 1e-6 and whole.command.position[whole.dof(joint)] == desired  # the same cycle
            assert abs(world.simulation.q[whole.dof(joint)] - 0.15) < 0.05
    finally:
        world.close()


def test_its_component_publishes_in_the_same_cycle(page, tmp_path, monkeypatch):
    """The page's component publishes a force that the next plugin and readers outside receive at once."""
    module = ModuleType("pushing")
    module.__file__ = str(tmp_path / "pushing.py")
    monkeypatch.setitem(sys.modules, "pushing", module)
    exec(blocks(page, "python")[1], module.__dict__)
    changed = copy.deepcopy(tree())
    (tmp_path / "cart.urdf").write_text(URDF)
    changed["ros"]["source"] = {"urdf": {"file": str(tmp_path / "cart.urdf")}}
    changed["modules"]["first"] |= {"class": "pushing:Pushing", "robot": "deaf"}
    changed["modules"]["second"] |= {"class": f"{__name__}:ListeningGenerator", "robot": "deaf"}
    changed["modules"]["shared"] = {"layer": "NRT", "plugins": ["any::first", "any::second", "any::first"]}
    file = tmp_path / "main.yaml"
    file.write_text(yaml.safe_dump({"mwoibn": changed}))
    bus = Bus()
    outside = [MemoryMiddleware(bus, "visitor").reader(topic, FORCE) for topic in ("first/push", "first_2/push")]
    members = generate_shared(load_shared(file).plugins, lambda _: MemoryMiddleware(bus, "shared"), Registry())
    members.sharing.turns.next()
    for plugin in members.plugins:
        plugin.cycle()
    received = members.plugins[1].component.received
    for reader in (received, *outside):
        reader.read()
        np.testing.assert_array_equal(reader.message.values, (0.0, 0.0, 10.0))
    assert received.channel.publication.component == "first"
