"""`solfer new component` as a user runs it: the test that it makes passes, unchanged."""

import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from support.modules import forget
from support.processes import SOURCES
from support.realtime.executor_plugins import Layer

from solfer.config.loading.rt_layer import read_layer
from solfer.plugins import Registry, generate, load_checked
from solfer_tools.cli.main import main

OTHERS = ("PYTEST_ADDOPTS", "PYTEST_CURRENT_TEST")


@pytest.fixture(scope="module")
def environment(repository):
    """Make the environment of a sourced workspace: solfer on the Python path, and its package for rospkg."""
    environment = {name: value for name, value in os.environ.items() if name not in OTHERS}
    paths = {"PYTHONPATH": SOURCES, "ROS_PACKAGE_PATH": repository}
    for name, path in paths.items():
        environment[name] = os.pathsep.join(filter(None, [str(path), os.environ.get(name)]))
    return environment


def run(command, folder, environment):
    """Run a command in a folder."""
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=200, check=False
    )


@pytest.fixture(scope="module")
def package(repository, environment, tmp_path_factory):
    """Make a folder with the new package `swing_joint`."""
    folder = tmp_path_factory.mktemp("new")
    done = run(
        [sys.executable, str(repository / "nodes" / "solfer"), "new", "component", "swing_joint"], folder, environment
    )
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "swing_joint"


def test_its_test_passes_unchanged(package, environment):
    done = run([sys.executable, "-m", "pytest", "-q", str(package)], package.parent, environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 passed" in done.stdout


def test_one_in_cpp_is_built_and_equals_its_twin(repository, environment, tmp_path):
    words = ["new", "component", "swing_joint", "--cpp"]
    made = run([sys.executable, str(repository / "nodes" / "solfer"), *words], tmp_path, environment)
    assert (made.returncode, made.stderr) == (0, "") and "libswing_joint.so::SwingJoint" in made.stdout
    done = run([sys.executable, "-m", "pytest", "-q", "swing_joint"], tmp_path, environment)
    assert done.returncode == 0 and "2 passed" in done.stdout, done.stdout + done.stderr


def test_it_is_drawn_before_it_is_built(package, capsys, caplog):
    assert main(["graph", str(package / "config/swing_joint.yaml"), "-n", "swing_joint"]) == 0
    assert "SwingJoint" in capsys.readouterr().out and not caplog.records


@pytest.mark.usefixtures("importable")
def test_its_configuration_is_right(package, monkeypatch, capsys):
    monkeypatch.chdir(package)
    assert main(["check", "config/swing_joint.yaml"]) == 0
    assert capsys.readouterr() == ("config/swing_joint.yaml: 1 configuration, no errors, no warnings\n", "")


class FileLayer(Layer):
    """An executor with the plugins of the file of an RT layer."""

    def _made(self, file):
        (listed,) = read_layer(file).load(load=load_checked)
        configuration = listed.configuration
        generator = Registry().find(listed.plugin, configuration.module.class_)
        return generate(configuration, self.node(configuration.module.name), generator)


def started(layer, world, package, folder):
    """Run the component in a layer, as its launch file does with the same argument; return its plugin."""
    if layer == "NRT":
        plugin = world.plugin("swing_joint", package / "config/swing_joint.yaml", "swing_joint.swing_joint:SwingJoint")
        world.run(0.2)
        return plugin
    file = package / "config/swing_joint_rt.yaml"
    layer = FileLayer(world, folder / "layer", [(file,)])
    switchboard = layer.executor.switchboard
    switchboard.commit(switchboard.plan(read_layer(file).executor.start))
    world.run(0.6)
    return layer["swing_joint"].plugin


@pytest.fixture
def importable(package, monkeypatch):
    """Let Python find the new package during the test."""
    monkeypatch.syspath_prepend(package / "src")
    yield
    forget("swing_joint")


@pytest.mark.daily(1)
@pytest.mark.parametrize("world", ["ROS", "XBOT"], indirect=True)
@pytest.mark.usefixtures("importable")
def test_it_moves_to_real_time_unchanged(world, package, tmp_path):
    plugin = started("RT" if hasattr(world, "node") else "NRT", world, package, tmp_path)
    component, measured = plugin.component, []
    for _ in range(40):
        world.run(0.05)
        measured.append(plugin.robot.state.position[component.dof] - component.center)
    assert max(measured) == pytest.approx(component.tags.amplitude, rel=0.3)
    assert min(measured) == pytest.approx(-component.tags.amplitude, rel=0.3)


def test_its_launch_file_knows_both_layers(package):
    launch = ElementTree.parse(package / "launch/swing_joint.launch")
    assert launch.find("arg[@name='layer']").get("default") == "NRT"
    files = [argument.get("value") for argument in launch.iter("arg") if argument.get("name") in ("config", "file")]
    places = {file.replace("$(find swing_joint)", str(package)) for file in files}
    assert all(Path(place).is_file() for place in places) and len(places) == 2


@pytest.mark.soak
def test_its_test_fails_when_nothing_moves(package, environment):
    component = package / "src" / "swing_joint" / "swing_joint.py"
    text = component.read_text()
    try:
        component.write_text(text.replace("self.tags.amplitude * math.sin", "0.0 * math.sin"))
        done = run([sys.executable, "-m", "pytest", "-q", str(package)], package.parent, environment)
    finally:
        component.write_text(text)
    assert done.returncode == 1 and "1 failed, 1 passed" in done.stdout
