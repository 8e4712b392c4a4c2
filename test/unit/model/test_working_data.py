"""Memory that Pinocchio computes in: the same numbers in less of it, and sizes that it cannot take."""

import os
import subprocess
import sys

import numpy as np
import pytest
from support.processes import SOURCES
from support.unit.chains import chain

from solfer.errors import ModelError
from solfer.model import Description, Kinematics, working_data

LOAD = """
import resource, sys
from support.unit.chains import chain
from solfer.robot import Robot

limit = int(sys.argv[1]) * 1000 * 1000
resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
robot = Robot.load(chain(500), floating_base=False)
robot.update()
print(robot.size, robot.dynamics.inertia_inverse.shape)
"""


def branched(size):
    """Describe a tree of `size` joints, of all kinds, in which each link carries up to three."""
    return chain(size, parent=lambda index: (index - 1) // 2, kinds=("revolute", "continuous", "prismatic"))


@pytest.mark.parametrize("text, floating_base", [(chain(12), None), (branched(30), True)])
def test_large_robots_get_the_same_numbers(text, floating_base, monkeypatch):
    """Less memory must not change results: the usual data of Pinocchio are the oracle, mostly to the bit."""
    description, random = Description.from_text(text), np.random.default_rng(3)
    usual = Kinematics(description, floating_base)
    monkeypatch.setattr("solfer.model.kinematics.working_data", working_data._small_data)
    small = Kinematics(description, floating_base)
    for _ in range(3):
        position, velocity = random.uniform(-1.0, 1.0, size=(2, usual.size))
        for kinematics in (usual, small):
            kinematics.update(position, velocity)
        for link in description.links:
            np.testing.assert_array_equal(small.position(link), usual.position(link))
            np.testing.assert_array_equal(small.rotation(link), usual.rotation(link))
            np.testing.assert_array_equal(small.jacobian(link), usual.jacobian(link))
        for array in ("jacobian", "placements"):
            np.testing.assert_array_equal(getattr(small.tree, array), getattr(usual.tree, array))
        np.testing.assert_array_equal(small.center_of_mass, usual.center_of_mass)
        np.testing.assert_array_equal(small.center_of_mass_jacobian, usual.center_of_mass_jacobian)
        np.testing.assert_allclose(small.inertia(position), usual.inertia(position), rtol=0, atol=1e-12)
        np.testing.assert_array_equal(small.bias(position, velocity), usual.bias(position, velocity))


@pytest.mark.slow
def test_five_hundred_joints_need_little_memory(repository):
    """The whole of Pinocchio's data would be 4 GB; numpy, numba and Pinocchio alone take 200 MB."""
    paths = f"{SOURCES}:{repository / 'test'}"
    done = subprocess.run(
        [sys.executable, "-c", LOAD, "500"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "500 (500, 500)\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    "text, what",
    [
        (chain(5000), "the robot has 5000 moving joints"),
        (chain(5000, kinds=("fixed",)), "the robot has 5000 joints in a row"),
    ],
)
def test_what_pinocchio_cannot_take_is_refused(text, what):
    with pytest.raises(ModelError, match=what) as caught:
        Kinematics(Description.from_text(text, "long.urdf"))
    assert (caught.value.where, caught.value.expected) == ("long.urdf", "at most 1000")
