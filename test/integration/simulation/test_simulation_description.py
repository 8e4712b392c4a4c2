"""What the simulation is made of: that of the URDF, or what differs is named."""

import math
import os
import shutil
import subprocess
import sys
from contextlib import closing
from functools import partial

import numpy as np
import pytest
from support.bullet import raw_bullet
from support.unit.colladas import COLLADA, SIZE

from solfer import Robot
from solfer.errors import ModelError
from solfer.model.collisions.distances import _geometry
from solfer.simulation import Simulation, read_bundle
from solfer.simulation.bullet import robot
from solfer.simulation.bullet.differences import differences

INERTIAL = (
    '<inertial><origin xyz="0.2 0 0"/><mass value="1.5"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
)
INERTIA = 0.01 + 1.5 * 0.2**2
"""Of the leaf of `door` about its hinge [kg m^2]."""


def door(dynamics="", shapes="", limit='lower="-1.5" upper="1.5" effort="20.5" velocity="2.5"'):
    """Make a leaf that turns about the vertical."""
    return (
        f'<robot name="door"><link name="world"/><link name="leaf">{INERTIAL}{shapes}</link>'
        '<joint name="hinge" type="revolute"><origin xyz="0 0 1.5"/><parent link="world"/><child link="leaf"/>'
        f'<axis xyz="0 0 1"/><limit {limit}/>{dynamics}</joint></robot>'
    )


def simulated(tmp_path, text, bare=True):
    """Simulate a robot; without gains unless it is `bare`."""
    (tmp_path / "door.urdf").write_text(text)
    if bare:
        return Simulation.from_file(read_bundle(tmp_path / "door.urdf"))
    (tmp_path / "gains.yaml").write_text("door: {gains: {hinge: {stiffness: 0.0, damping: 0.0}}}\n")
    (tmp_path / "robot.yaml").write_text(
        "name: door\nurdf: door.urdf\nfloating_base: false\ngains: gains.yaml\n"
        "controllers: {position_controller: {type: impedance}}\n"
    )
    return Simulation.from_file(tmp_path / "robot.yaml")


def coast(simulation, speed, duration):
    """Let the joint go at a speed [rad/s]; return its speed later."""
    simulation.body.robot.place_joint(0, -1.0, speed)
    for _ in range(round(duration * 1e3)):
        simulation.step()
    return simulation.v[0]


@pytest.mark.parametrize("damping", [0.0, 0.2, 1.0])
def test_damping_slows_a_joint_down(tmp_path, damping):
    """The speed is v exp(-d t / I)."""
    with closing(simulated(tmp_path, door(f'<dynamics damping="{damping}"/>'), bare=False)) as run:
        speed = coast(run, 1.0, 0.2)
    assert speed == pytest.approx(math.exp(-damping * 0.2 / INERTIA), rel=0.03, abs=1e-3)


def test_friction_stops_a_joint(tmp_path):
    """The speed falls by f t / I, and the joint stays where it has come to rest."""
    with closing(simulated(tmp_path, door('<dynamics friction="0.14"/>'), bare=False)) as run:
        assert coast(run, 1.0, 0.25) == pytest.approx(1.0 - 0.14 * 0.25 / INERTIA, abs=0.01)
        assert coast(run, 1.0, 1.0) == pytest.approx(0.0, abs=1e-6)


def test_losses_of_an_actuator_replace_those_of_its_joint(tmp_path):
    text = door('<dynamics damping="5" friction="5"/>')
    simulated(tmp_path, text, bare=False).close()
    (tmp_path / "actuators.yaml").write_text(
        "door: {actuators: {hinge: {type: SEA, Ks: 8e4, D: 2.0, B: 0.01, phi: 0.001, Torque_limit: 1.0}}}\n"
    )
    record = tmp_path / "robot.yaml"
    record.write_text(record.read_text() + "actuators: actuators.yaml\n")
    with closing(Simulation.from_file(record)) as run:
        assert coast(run, 1.0, 0.1) > 0.8


SHAPES = """
  <collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
  <collision><origin xyz="1 0 0"/><geometry><sphere radius="0.25"/></geometry></collision>
  <collision><origin xyz="2 0 0" rpy="1 0 0"/><geometry><cylinder radius="0.1" length="0.4"/></geometry></collision>
  <collision><origin xyz="3 0 0"/><geometry><capsule radius="0.15" length="0.5"/></geometry></collision>"""


@pytest.mark.parametrize(
    "before, after, named",
    [
        ("", "", []),
        ('mass value="1.5"', 'mass value="1.6"', ["link 'leaf': mass 1.5 instead of 1.6 kg"]),
        (
            'size="0.1 0.2 0.3"',
            'size="0.1 0.2 0.4"',
            ["link 'leaf': box of the size 0.1 0.2 0.3 instead of 0.1 0.2 0.4"],
        ),
        ('radius="0.25"', 'radius="0.2"', ["link 'leaf': sphere of the size 0.25 0.25 0.25 instead of 0.2"]),
        ('length="0.4"', 'length="0.3"', ["link 'leaf': cylinder of the size 0.4 0.1 0 instead of 0.3 0.1"]),
        ('radius="0.15"', 'radius="0.1"', ["link 'leaf': capsule of the size 0.5 0.15 0 instead of 0.5 0.1"]),
        (
            "</link><joint",
            "<collision><geometry><mesh filename='a.obj'/></geometry></collision></link><joint",
            ["4 of 5"],
        ),
        ('lower="-1.5"', 'lower="-1"', ["joint 'hinge': lower limit -1.5 instead of -1"]),
        ('upper="1.5"', 'upper="1"', ["joint 'hinge': upper limit 1.5 instead of 1"]),
        ('effort="20.5"', 'effort="20"', ["joint 'hinge': effort limit 20.5 instead of 20"]),
        ('velocity="2.5"', 'velocity="2"', ["joint 'hinge': velocity limit 2.5 instead of 2"]),
        ('name="hinge"', 'name="pin"', ["joint 'pin' is not there"]),
    ],
)
def test_what_differs_from_the_urdf_is_named(tmp_path, before, after, named):
    text = door(shapes=SHAPES)
    with closing(simulated(tmp_path, text)) as run:
        asked = text.replace('<link name="world"/>', "").replace(before, after)
        found = list(differences(run._engine._world, run.body.robot.number, asked))
    assert len(found) == len(named) and all(map(str.__contains__, found, named))


@pytest.mark.parametrize(("unit", "scale"), [("0.01", "10 10 10"), ("0.3048", "0.5 0.5 -0.5")])
def test_physics_and_collisions_read_a_mesh_in_one_unit(tmp_path, unit, scale):
    (tmp_path / "box.dae").write_text(COLLADA.format(unit=unit))
    shape = f'<collision><geometry><mesh filename="box.dae" scale="{scale}"/></geometry></collision>'
    run = simulated(tmp_path, door(shapes=shape))
    size = float(unit) * abs(np.array(scale.split(), dtype=float)) * SIZE
    bullet = raw_bullet(run)
    _, corners = bullet.module.getMeshData(bullet.body, 0, physicsClientId=bullet.client)
    np.testing.assert_allclose(np.ptp(corners, axis=0), size, atol=1e-5)
    kinematics = Robot.load(tmp_path / "door.urdf", None, floating_base=False).kinematics
    box = _geometry(kinematics, {"leaf"}).geometryObjects[0].geometry
    box.computeLocalAABB()
    np.testing.assert_allclose(box.aabb_local.max_ - box.aabb_local.min_, size, atol=1e-5)


@pytest.mark.parametrize("unit", ["-1", "inch"])
def test_a_mesh_without_a_unit_is_one_error(tmp_path, unit):
    (tmp_path / "box.dae").write_text(COLLADA.format(unit=unit))
    shape = '<collision><geometry><mesh filename="box.dae"/></geometry></collision>'
    with pytest.raises(ModelError, match=rf'box.dae: <unit meter="{unit}">\n  expected: a number above 0'):
        simulated(tmp_path, door(shapes=shape))


def test_differences_are_logged_when_a_robot_is_loaded(tmp_path, caplog, monkeypatch):
    monkeypatch.setattr(robot, "warn_of_differences", partial(_warn_of_another, robot.warn_of_differences))
    simulated(tmp_path, door(shapes=SHAPES)).close()
    assert caplog.messages == [
        f"{tmp_path}/door.urdf: the simulation differs from it: link 'leaf': 4 of 3 collision shapes"
    ]


def _warn_of_another(warn, client, number, text, where):
    start = text.index("<collision>")
    warn(client, number, text[:start] + text[text.index("</collision>") + len("</collision>") :], where)


LOCALE = """
import locale, sys
import pybullet
from solfer.simulation import Simulation, read_bundle
locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
simulation = Simulation.from_file(read_bundle(sys.argv[1]))
robot = simulation.body.robot
assert locale.localeconv()["decimal_point"] == ","
print(robot.mass(), *pybullet.getJointInfo(robot.number, 0, robot._world.number)[8:12])
"""


@pytest.mark.slow
def test_a_locale_with_decimal_commas_changes_nothing(tmp_path):
    """PyBullet reads numbers by the locale of the process: a URDF has to mean the same in all of them."""
    if shutil.which("localedef") is None:
        pytest.skip("no localedef")
    made = ["localedef", "-i", "de_DE", "-f", "UTF-8", str(tmp_path / "de_DE.UTF-8")]
    if subprocess.run(made, capture_output=True, check=False).returncode > 1 or not (tmp_path / "de_DE.UTF-8").exists():
        pytest.skip("no sources of locales")
    (tmp_path / "door.urdf").write_text(door())
    run = subprocess.run(
        [sys.executable, "-c", LOCALE, str(tmp_path / "door.urdf")],
        env=os.environ | {"LOCPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    np.testing.assert_allclose([float(word) for word in run.stdout.split()], [1.5, -1.5, 1.5, 20.5, 2.5])
