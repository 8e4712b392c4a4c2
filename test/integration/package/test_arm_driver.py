"""The driver of docs/how-to/hardware.md: a plugin moves an arm whose lower level it is, on mocked electronics."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pybullet_data
import pytest
import yaml

from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import PluginState, Registry, generate
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.main import main

URDF = Path(pybullet_data.getDataPath()) / "kuka_iiwa/model.urdf"


@pytest.fixture
def page(repository):
    return (repository / "docs/how-to/hardware.md").read_text()


@pytest.fixture
def example(repository):
    """Import examples/arm_driver.py."""
    specification = importlib.util.spec_from_file_location("arm_driver", repository / "examples/arm_driver.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture
def world(example, tmp_path):
    """Run the driver in memory; yields bus, device, and a function that starts the plugin of a node."""
    package = tmp_path / "my_robot"
    assert main(["new", "robot", "my_robot", "--urdf", str(URDF), "--package", str(package)]) == 0
    record = example.read_bundle(package / "config/robots/my_robot/robot.yaml")
    bundle = example.load_bundle(record)
    bus, device = Bus(robot_parameters(record)), example.MockDevice(bundle.kinematics)
    driver = example.ArmDriver(bundle, device, MemoryMiddleware(bus, "arm_driver"))
    bus.every(1.0 / example.RATE, driver.cycle)
    configuration = load(package / "config/my_robot.yaml", "joint_states")

    def start(node):
        plugin = generate(configuration, MemoryMiddleware(bus, node), Registry().find("joint_states"))
        bus.every(1.0 / plugin.rate, plugin.cycle)
        return plugin

    return bus, device, start


@pytest.mark.parametrize(("page", "file"), [("hardware", "arm_driver"), ("ros_control", "ros_control_arm")])
def test_the_page_has_the_whole_file(page, file, repository):
    text = (repository / f"docs/how-to/{page}.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert code == (repository / f"examples/{file}.py").read_text()


@pytest.mark.slow
def test_a_plugin_moves_the_arm_of_the_driver(world, page):
    """The joint of the page goes where the page asks; the others stay; the plugin owns them all."""
    bus, device, start = world
    plugin = start("joint_states")
    bus.run_until(bus.time + 0.2)
    assert plugin.life is PluginState.RUNNING
    (asked,) = re.findall(r'^rosservice call /joint_states/trajectory "(.*)"$', page, re.MULTILINE)
    request = yaml.safe_load(asked)
    reply = bus.call("joint_states/trajectory", joints=tuple(request["joints"]), positions=tuple(request["positions"]))
    bus.run_until(bus.time + 2.5)
    assert reply.result(0).success, reply.result(0).message
    goal = np.zeros(len(plugin.robot.dofs))
    goal[plugin.robot.dof(request["joints"][0])] = request["positions"][0]
    np.testing.assert_allclose(device.read()[0], goal, atol=0.01)
    bus.run_until(bus.time + 1.0)
    (report,) = (each for name, each in MemoryMiddleware(bus, "watcher").reports().items() if "lower_level" in name)
    assert "joint_states" in str(report.values["position_controller"])


def test_the_arm_holds_when_its_plugin_is_gone(world, example):
    """Torques carry the weight: without them the mock falls, so that the test can fail."""
    bus, device, _ = world
    device.read()[0][1] = 0.3
    start = device.read()[0].copy()
    bus.run_until(bus.time + 1.0)
    kinematics = device._kinematics
    fallen = example.MockDevice(kinematics)
    fallen.read()[0][1] = 0.3
    for _ in range(500):
        fallen.write(np.zeros(kinematics.size))
    assert abs(fallen.read()[0][1] - 0.3) > 0.5
    assert np.abs(device.read()[0]).max() < 0.02 < np.abs(start).max()  # it was held at zero, and is there again
