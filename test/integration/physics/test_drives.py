"""Robots on the ground in PyBullet: their drives do the torque that is sent, whatever their damping."""

import importlib.util
from contextlib import closing
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np
import pytest
from support.integration.torque_robot import ROBOTS
from support.integration.world import ROBOT

from solfer.lower_level import ImpedanceController
from solfer.simulation import Simulation, read_bundle

EXAMPLES = {
    "go2": ("go2_description/urdf/go2.urdf", "go2_description/srdf/go2.srdf"),
    "go1": ("go1_description/urdf/go1.urdf", "go1_description/srdf/go1.srdf"),
    "b1": ("b1_description/urdf/b1.urdf", "b1_description/srdf/b1.srdf"),
    "hyq": ("hyq_description/robots/hyq_no_sensors.urdf", "hyq_description/srdf/hyq.srdf"),
    "anymal_c": ("anymal_c_simple_description/urdf/anymal.urdf", "anymal_c_simple_description/srdf/anymal.srdf"),
    "solo12": ("solo_description/robots/solo12.urdf", "solo_description/srdf/solo.srdf"),
    "talos": ("talos_data/robots/talos_reduced.urdf", "talos_data/srdf/talos.srdf"),
}
"""URDF and SRDF of robots without springs, in example-robot-data."""


def standing(name, damping=1.0):
    """Let a robot come to rest on its springs, with a factor of its damping."""
    if name == "centauro":
        simulation = Simulation.from_file(read_bundle(ROBOT / "robot.yaml").with_perfect_sensors())
    elif name == "laikago":
        folder = Path(importlib.util.find_spec("pybullet_data").origin).parent
        simulation = Simulation.from_file(read_bundle(folder / "laikago/laikago_toes_zup.urdf", None, True))
    else:
        try:
            share = Path(str(distribution("example-robot-data").locate_file(ROBOTS)))
        except PackageNotFoundError:
            pytest.skip("example-robot-data is not installed")
        urdf, srdf = EXAMPLES[name]
        simulation = Simulation.from_file(read_bundle(share / urdf, share / srdf, True))
    for controller in impedances(simulation):
        controller.damping *= damping
    advance(simulation, 2000)
    return simulation


def impedances(simulation):
    """List the impedance controllers of a robot."""
    every = simulation.lower_level.controllers.values()
    return [controller for controller in every if isinstance(controller, ImpedanceController)]


def missing(simulation):
    """Advance by a step; return sent torques less those that are done, sent torques, and limits, shape (n,) each [Nm].

    What was sent counts at the end of the step, for position and velocity of the motors where there are springs.
    """
    simulation.step()
    position, velocity, done, compliance = simulation.q, simulation.v, simulation.torque, np.zeros(len(simulation.q))
    if (motors := simulation.lower_level.drives.two_mass) is not None:
        elastic, motor_position, motor_velocity, compliance = motors.motor_side
        position = np.where(elastic, motor_position, position)
        velocity = np.where(elastic, motor_velocity, velocity)
        done = motors.drive
    sent = np.zeros(len(position))
    for each in impedances(simulation):
        at = each.dofs
        sent[at] = each.stiffness * (each.target - position[at]) - each.damping * velocity[at] + each.applied_effort
        sent[at] /= 1.0 + compliance[at] * each.stiffness
    dofs = np.concatenate([controller.dofs for controller in impedances(simulation)])
    return (sent - done)[dofs], sent[dofs], simulation.kinematics.effort_limit[dofs]


def command(simulation, torques):
    """Replace the springs by torques, shape (n,) [Nm]."""
    begin = 0
    for each in impedances(simulation):
        each.stiffness[:] = 0.0
        each.effort[:] = torques[begin : begin + len(each.joints)]
        begin += len(each.joints)


def advance(simulation, steps):
    """Let steps of a millisecond pass."""
    for _ in range(steps):
        simulation.step()


@pytest.mark.slow
@pytest.mark.daily(4)
@pytest.mark.parametrize("name", ["go2", "hyq", "centauro", "talos", "go1", "b1", "anymal_c", "solo12", "laikago"])
def test_a_standing_robot_does_what_is_sent(name):
    """At rest whatever the damping; a step of the torque within 5 ms, while the robot rises against its dampers."""
    with closing(standing(name)) as simulation:
        away, carrying, limit = missing(simulation)
        assert np.abs(carrying).max() > 0.1
        assert (np.abs(away) <= np.maximum(0.01 * np.abs(carrying), 0.001 * limit)).all()
        command(simulation, carrying)
        advance(simulation, 20)
        command(simulation, 1.3 * carrying)
        advance(simulation, 4)
        away, sent, _ = missing(simulation)
        assert np.abs(away).max() <= 0.01 * np.abs(sent).max()
    with closing(standing(name, damping=10.0)) as simulation:
        away, sent, limit = missing(simulation)
        assert (np.abs(away) <= np.maximum(0.01 * np.abs(sent), 0.001 * limit)).all()
