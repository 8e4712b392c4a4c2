"""Two plugins on disjoint joints of one controller: each has a pipe of its own to it, and no secondary file."""

from pathlib import Path

import pybullet_data
import pytest
import yaml

from solfer.config import load
from solfer.errors import ClaimRefused
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.plugins import PluginState, Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.main import main

URDF = Path(pybullet_data.getDataPath()) / "kuka_iiwa/model.urdf"
JOINTS = tuple(joint.name for joint in Description.from_file(URDF).moving_joints)
GROUPS = {"near": JOINTS[:4], "far": JOINTS[4:]}


@pytest.fixture
def configuration(tmp_path):
    """Make the package of an arm, and a module on each of its halves."""
    groups = "".join(
        f'<group name="{name}">{"".join(f"<joint name={chr(34)}{joint}{chr(34)}/>" for joint in joints)}</group>'
        for name, joints in GROUPS.items()
    )
    (tmp_path / "arm.srdf").write_text(f'<robot name="lbr_iiwa">{groups}</robot>')
    files = ["--urdf", str(URDF), "--srdf", f"{tmp_path}/arm.srdf", "--package", f"{tmp_path}/arm"]
    assert main(["new", "robot", "arm", *files]) == 0
    file = tmp_path / "arm/config/arm.yaml"
    root = yaml.safe_load(file.read_text())
    tree = root["mwoibn"]
    pipe, module = tree["controller"]["position_controller"], tree["modules"]["joint_states"]
    for name in GROUPS:
        pipe_of = pipe | {"controller": "position_controller", "dofs": pipe["dofs"] | {"chain": name}}
        tree["controller"][f"{name}_positions"] = pipe_of
        tree["ros"]["controller"][f"{name}_positions"] = {"sink": "/command"}
        own = {"class": "solfer.components.joint_states:JointStates", "controller": [f"{name}_positions"]}
        tree["modules"][f"{name}_joints"] = module | own | {"chain": name}
    file.write_text(yaml.safe_dump(root))
    return file


@pytest.fixture
def world(configuration):
    """Simulate the arm; yields a function that starts a module."""
    bundle = read_bundle(configuration.parent / "robots/arm/robot.yaml")
    bus, simulation = Bus(robot_parameters(bundle)), Simulation.from_file(bundle)
    bus.every(0.001, SimulationServer(simulation, MemoryMiddleware(bus, "simulator")).cycle)

    def start(name):
        plugin = generate(load(configuration, name), MemoryMiddleware(bus, name), Registry().find("joint_states"))
        bus.every(1.0 / plugin.rate, plugin.cycle)
        return plugin

    yield bus, simulation, start
    simulation.close()


def test_the_configuration_is_free_of_mistakes(configuration, capsys):
    assert main(["check", str(configuration)]) == 0
    assert capsys.readouterr().out.endswith("4 configurations, no errors, no warnings\n")


def test_each_plugin_commands_its_own_joints(world):
    """Both run side by side; each moves a joint of its half, and a third one on all joints is refused."""
    bus, simulation, start = world
    plugins = {name: start(f"{name}_joints") for name in GROUPS}
    bus.run_until(bus.time + 0.3)
    for name, joints in GROUPS.items():
        plugin = plugins[name]
        assert plugin.life is PluginState.RUNNING
        assert {joint for controller, _, joint in plugin.outputs.claims if controller == "position_controller"} == {
            *joints
        }
    goals = {"near": (JOINTS[0], 0.3), "far": (JOINTS[5], -0.2)}
    for name, (joint, goal) in goals.items():
        answer = bus.call(f"{name}_joints/trajectory", joints=(joint,), positions=(goal,))
        bus.run_until(bus.time + 2.5)
        assert answer.result(0).success
    for joint, goal in goals.values():
        assert simulation.q[JOINTS.index(joint)] == pytest.approx(goal, abs=0.02)
    start("joint_states")
    with pytest.raises(ClaimRefused, match="near_joints"):
        bus.run_until(bus.time + 0.5)
