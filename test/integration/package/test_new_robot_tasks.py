"""`solfer new robot`, then the commands of its page: a quadruped squats, and the tip of an arm draws circles."""

import re
import shlex
from contextlib import contextmanager
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pybullet_data
import pytest
import yaml

from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import PluginState, Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.main import main
from solfer_tools.navigation import Navigation, ReferenceCourse, read_references

COLLECTION = Path(pybullet_data.getDataPath())
GO2 = (
    Path(distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data/robots"))
    / "go2_description"
)
RADIUS, TURN = 0.04, 4.0
"""Of the circle of the page's file [m], [s]."""


@pytest.fixture
def commands(repository):
    """Return the lines of commands of the page."""
    return (repository / "docs/tutorials/bring_your_robot.md").read_text().splitlines()


@contextmanager
def tasks(folder, capsys, *arguments):
    """Make a package, and run its plugin `inverse_kinematics`; yields clock, simulation and configuration."""
    assert main(["new", "robot", "my_robot", *map(str, arguments), "--package", str(folder / "my_robot")]) == 0
    file = folder / "my_robot/config/my_robot.yaml"
    capsys.readouterr()
    assert main(["check", str(file)]) == 0
    assert ", no errors" in capsys.readouterr().out
    bundle = read_bundle(file.parent / "robots/my_robot/robot.yaml")
    bus, simulation = Bus(robot_parameters(bundle)), Simulation.from_file(bundle)
    bus.every(0.001, SimulationServer(simulation, MemoryMiddleware(bus, "simulator")).cycle)
    node = MemoryMiddleware(bus, "inverse_kinematics")
    plugin = generate(load(file, "inverse_kinematics"), node, Registry().find("inverse_kinematics"))
    bus.every(1.0 / plugin.rate, plugin.cycle)
    bus.run_until(bus.time + 3.0)
    assert plugin.life is PluginState.RUNNING
    yield bus, simulation, file
    simulation.close()


def test_a_new_quadruped_squats(tmp_path, capsys, commands):
    """The base goes where the page asks it to go, by the truth of the simulation."""
    files = ("--urdf", GO2 / "urdf/go2.urdf", "--srdf", GO2 / "srdf/go2.srdf")
    (asked,) = (line for line in commands if line.startswith("rosservice call /inverse_kinematics/reference"))
    request = yaml.safe_load(shlex.split(asked)[3])
    with tasks(tmp_path, capsys, *files, "--floating-base") as (bus, simulation, _):
        start = simulation.body.position.copy()
        reply = bus.call("inverse_kinematics/reference", **request)
        bus.run_until(bus.time + 4.0)
        assert reply.result(0).success, reply.result(0).message
        assert simulation.body.position - start == pytest.approx(request["values"][:3], abs=0.003)


@pytest.mark.parametrize("urdf", ["kuka_iiwa/model.urdf", "franka_panda/panda.urdf"], ids=["iiwa", "panda"])
def test_the_tip_of_a_new_arm_draws_circles(tmp_path, capsys, repository, commands, urdf):
    """Within 3 mm of a circle, by the truth of the simulation, once it moves with its whole speed."""
    (asked,) = (line for line in commands if line.startswith("rosrun solfer navigation reference"))
    with tasks(tmp_path, capsys, "--urdf", COLLECTION / urdf) as (bus, simulation, file):
        link, places = re.search(r"tip: .*link: (\w+)", file.read_text())[1], []
        bus.every(0.01, lambda: places.append((bus.time, *simulation.state.now.position(link))))
        begin, node = bus.time, MemoryMiddleware(bus, "navigation")
        course = ReferenceCourse(node, read_references(repository / shlex.split(asked)[4]), "inverse_kinematics")
        assert Navigation(node, course, "navigation", 50.0).run() == 0
        rows = np.array([row[1:] for row in places if 3.0 < row[0] - begin <= 3.0 + 2.0 * TURN])
        centre = rows.mean(axis=0)
        away = np.hypot(np.hypot(*(rows[:, :2] - centre[:2]).T) - RADIUS, rows[:, 2] - centre[2])
        assert away.max() < 0.003
        assert np.ptp(rows, axis=0)[:2] == pytest.approx(2.0 * RADIUS, abs=0.006)
