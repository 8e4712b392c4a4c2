"""`solfer new robot --floating-base`: a robot whose URDF has no floating joint follows tasks of its base."""

import re
from pathlib import Path

import pybullet_data
import pytest
import yaml

from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.plugins import PluginState, Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.main import main

COLLECTION = Path(pybullet_data.getDataPath())


LEGS = {"mini_cheetah/mini_cheetah.urdf": (0.0, -0.8, 1.6), "a1/a1.urdf": (0.0, 0.9, -1.8)}
"""Positions of the three joints of a leg that stands [rad]."""


@pytest.fixture(scope="module", params=LEGS)
def floating(tmp_path_factory, request):
    """Make the package of a quadruped whose URDF has no floating joint, and whose SRDF has a state with bent legs."""
    folder, urdf = tmp_path_factory.mktemp("floating"), COLLECTION / request.param
    robot = Description.from_file(urdf)
    joints = [joint.name for joint in robot.moving_joints]
    group = "".join(f'<joint name="{name}"/>' for name in joints)
    bent = "".join(
        f'<joint name="{name}" value="{value}"/>' for name, value in zip(joints, 4 * LEGS[request.param], strict=True)
    )
    (folder / "dog.srdf").write_text(
        f'<robot name="{robot.name}"><group name="legs">{group}</group>'
        f'<group_state name="standing" group="legs">{bent}</group_state></robot>'
    )
    files = ["--urdf", str(urdf), "--srdf", f"{folder}/dog.srdf"]
    assert main(["new", "robot", "dog", *files, "--floating-base", "--package", f"{folder}/dog"]) == 0
    return folder / "dog/config/dog.yaml"


def test_a_floating_base_is_free_of_mistakes(floating, capsys):
    assert main(["check", str(floating)]) == 0
    assert capsys.readouterr().out.endswith("2 configurations, no errors, no warnings\n")
    assert main(["show", str(floating), "-n", "inverse_kinematics"]) == 0
    assert "point: pose" in capsys.readouterr().out


@pytest.mark.daily(3)
@pytest.mark.parametrize("served", [True, False], ids=["simulator", "raw"])
def test_a_floating_base_follows_its_task(floating, served, repository):
    """The base goes where the page asks it to go, by the truth of the simulation.

    The description is what a simulator serves, or the URDF itself, as a launch file gives it.
    """
    bundle = read_bundle(floating.parent / "robots/dog/robot.yaml")
    parameters = robot_parameters(bundle)
    if not served:
        parameters["/robot_description"] = bundle.urdf.location.read_text()
    bus, simulation = Bus(parameters), Simulation.from_file(bundle)
    bus.every(0.001, SimulationServer(simulation, MemoryMiddleware(bus, "simulator")).cycle)
    configuration = load(floating, "inverse_kinematics")
    middleware = MemoryMiddleware(bus, "inverse_kinematics")
    plugin = generate(configuration, middleware, Registry().find("inverse_kinematics"))
    assert plugin.robot.dofs[:6] == ("x", "y", "z", "rx", "ry", "rz")
    bus.every(1.0 / plugin.rate, plugin.cycle)
    bus.run_until(bus.time + 1.0)
    assert plugin.life is PluginState.RUNNING
    start = simulation.body.position.copy()
    page = (repository / "docs/tutorials/bring_your_robot.md").read_text()
    (asked,) = re.findall(r'^rosservice call /inverse_kinematics/reference "(.*)"$', page, re.MULTILINE)
    request = yaml.safe_load(asked)
    reply = bus.call("inverse_kinematics/reference", **request)
    bus.run_until(bus.time + 4.0)
    assert reply.result(0).success, reply.result(0).message
    assert simulation.body.position - start == pytest.approx(request["values"][:3], abs=0.002)
    simulation.close()
