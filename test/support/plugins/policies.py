"""Configurations of policies of CENTAURO."""

import numpy as np
from support import robots
from support.integration.world import ROBOT
from support.plugins.plugin import WHEELS, configuration
from support.unit import onnx_files

from solfer.policy import Environment

POLICY = "solfer.components.policy:Policy"
TERMS = ("angular_velocity", "projected_gravity", "commands", "joint_position", "joint_velocity", "last_action")


def legs():
    """Return the joints of legs and arms without wheels, and where they are at the start, by name."""
    robot = robots.centauro("mammal_wide_straight", actuators=True)
    return {
        robot.dofs[dof]: float(robot.state.position[dof]) for dof in robot.actuated if robot.dofs[dof] not in WHEELS
    }


def file_of(folder, weights=0.0, offset=0.0, **tags):
    """Write a linear network of all joints but the wheels, and a configuration with it; returns the configuration."""
    joints = legs()
    count = len(joints)
    onnx_files.linear(folder / "network.onnx", np.broadcast_to(weights, (9 + 3 * count, count)), np.full(count, offset))
    module = {
        "class": POLICY,
        "robot": "inertial",
        "file": "network.onnx",
        "joints": list(joints),
        "default": joints,
        "observations": [{"term": term} for term in TERMS],
        "action": {"scale": 0.25},
        "rate": 50.0,
        **tags,
    }
    return configuration(folder, **module)


def upright(environment):
    """Return how upright the base is."""
    return float(np.cos(environment.tilt)), environment.tilt > 0.5


def draw(environment):
    """Draw masses, friction, a push and a velocity."""
    random = environment.random
    environment.scale_masses(float(random.choice((0.9, 1.1))))
    environment.simulation.set_friction("ground", random.uniform(0.5, 1.0))
    environment.simulation.pushes.add("pelvis", random.uniform(-300.0, 300.0, 3), np.zeros(3), 0.5)
    environment.velocity[:] = random.uniform(-0.1, 0.1, 3)


def made(file, **options):
    """Make the environment of a configuration."""
    return Environment(file, "test", ROBOT / "robot.yaml", upright, **options)
