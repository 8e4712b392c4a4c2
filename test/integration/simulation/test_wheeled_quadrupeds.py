"""Quadrupeds that an example puts on wheels drive by their files alone."""

import json
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pytest

from solfer.config import load
from solfer.errors import ComponentError
from solfer.interfaces.geometry import Twist, Vector
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.plugins import Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.server.publications import robot_parameters

NAME, STEP = "wheeled_motion", 0.001
WAY = 0.2 * (3.05 - 0.2 / 0.3) + 0.2**2 / 0.3
"""With 0.2 m/s for 3 s, and 0.55 s of patience after the last message, at 0.3 m/s2 [m]."""


def made(repository, folder, *arguments):
    """Let the example make a robot; return its folder."""
    command = [sys.executable, str(repository / "examples/wheeled_quadruped.py"), *arguments[:1], str(folder)]
    done = subprocess.run([*command, *arguments[1:]], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@contextmanager
def driven(folder):
    """Simulate a robot with its plugin; yields a function that drives for 3 s, and the simulation."""
    bundle = folder / "robot.yaml"
    bus, simulation = Bus(robot_parameters(read_bundle(bundle))), Simulation.from_file(bundle)
    bus.every(STEP, SimulationServer(simulation, MemoryMiddleware(bus, "simulator")).cycle)
    plugin = generate(load(folder / "plugins.yaml", NAME), MemoryMiddleware(bus, NAME), Registry().find(NAME))
    bus.every(1.0 / plugin.rate, plugin.cycle)
    bus.run_until(1.0)

    def drive(x=0.0, y=0.0, turn=0.0):
        for _ in range(6):
            plugin.component.drive.receive(Twist(Vector(x, y), Vector(z=turn)))
            bus.run_until(bus.time + 0.5)
        bus.run_until(bus.time + 2.0)
        return simulation.q[:6].copy()

    try:
        yield drive, simulation
    finally:
        plugin.stop()
        simulation.close()


def test_steered_wheels_drive_and_turn(repository, tmp_path):
    with driven(made(repository, tmp_path, "anymal_c")) as (drive, simulation):
        begin = simulation.q[:6].copy()
        forward = drive(x=0.2)
        np.testing.assert_allclose((forward - begin)[:2], (WAY, 0.0), atol=0.03)
        turned = drive(turn=0.3)
        assert turned[5] - forward[5] == pytest.approx(0.3 * 3.05, abs=0.1)
        np.testing.assert_allclose(turned[:2], forward[:2], atol=0.02)
        assert np.abs(simulation.v).max() < 0.01


def test_the_benchmark_drives_with_an_estimated_base(repository, tmp_path):
    """Of the odometry that the example's configuration has, with the errors of sensors."""
    folder = made(repository, tmp_path, "anymal_c")
    command = [sys.executable, str(repository / "benchmark/driving.py"), "turn", "--json", "--estimated"]
    done = subprocess.run(
        [*command, "--robot", str(folder / "robot.yaml")], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert figures["done"] and not figures["toppled"] and figures["held_back"] == 0
    assert figures["com_rms"] < 3e-3 and figures["vertex_rms"] < 5e-3 and figures["heading_rms"] < 0.01


@pytest.mark.soak
def test_fixed_wheels_say_what_they_cannot(repository, tmp_path, caplog):
    with driven(made(repository, tmp_path, "go2")) as (drive, simulation):
        begin = simulation.q[:6].copy()
        moved = drive(0.2, 0.1, 0.3)
        np.testing.assert_allclose((moved - begin)[:2], (WAY, 0.0), atol=0.03)
        assert moved[5] == pytest.approx(begin[5], abs=0.01)
    said = [record.getMessage() for record in caplog.records if "nothing steers" in record.getMessage()]
    assert any("'FL_foot_wheel'" in text and "sideways" in text and "no turns of 0." in text for text in said)


def test_a_floating_joint_of_the_urdf_is_kept(repository, tmp_path, monkeypatch):
    """The robot is the same as that of a URDF without one, but for the names of the URDF."""
    monkeypatch.syspath_prepend(str(repository / "examples"))
    import wheeled_quadruped as example

    share = Path(str(distribution("example-robot-data").locate_file(example.SHARE)))
    go2 = example.ROBOTS["go2"]
    text = (share / "robots" / go2.urdf).read_text()
    root = '<link name="ground"/><joint name="free" type="floating"><parent link="ground"/><child link="base"/></joint>'
    (tmp_path / "floating.urdf").write_text(text.replace("</robot>", f"{root}</robot>"))
    made = {}
    for name, robot in (("plain", go2), ("floating", replace(go2, urdf=f"{tmp_path}/floating.urdf"))):
        (tmp_path / name).mkdir()
        example.write(tmp_path / name, name, robot, False, share)
        made[name] = Description.from_file(tmp_path / name / "robot.urdf")
    assert (made["floating"].floating.name, made["floating"].root) == ("free", "ground")
    links = [set(each.links) for each in made.values()]
    assert links[0] - links[1] == {"world"} and links[1] - links[0] == {"ground"}
    assert made["plain"].moving_joints == made["floating"].moving_joints


def test_steering_needs_a_joint(repository, tmp_path):
    folder = made(repository, tmp_path, "go2")
    text = (folder / "plugins.yaml").read_text().replace("BASE, CONTACT", "BASE, STEERING, CONTACT")
    (folder / "plugins.yaml").write_text(text)
    with pytest.raises(ComponentError, match="nothing steers the wheel 'FL_foot_wheel'"), driven(folder):
        pass
