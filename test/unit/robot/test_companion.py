"""Robots that share what is measured and what is computed of it."""

from pathlib import Path

import numpy as np
import pytest
from support.robots import centauro

from solfer import Robot
from solfer.errors import ModelError, SizeMismatch
from solfer.model import Description
from solfer.model.urdf.cut import cut

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"


@pytest.fixture
def pair():
    robot = centauro()
    return robot, robot.companion()


def test_all_that_is_measured_is_shared(pair):
    one, other = pair
    other.state.position[6:] = 0.3
    other.motor.torque = np.arange(other.size)
    assert one.update() and not other.update()
    assert np.array_equal(one.state.position, other.state.position)
    assert np.array_equal(one.motor.torque, other.motor.torque) and one.motor.version("torque") == 1
    assert one.kinematics is other.kinematics and one.dynamics is other.dynamics
    assert one.contacts is other.contacts and one.center_of_mass is other.center_of_mass
    other.contacts.wrenches[0, 2] = 500.0
    assert one.contacts.forces[0, 2] == 500.0 and one.center_of_pressure is other.center_of_pressure
    assert one.shares_measurement(other) and other.companion().shares_measurement(one)
    assert not one.shares_measurement(centauro())


def test_what_a_component_wants_is_its_own(pair):
    one, other = pair
    other.command.position[:] = 1.0
    other.command.add("stiffness")
    assert not one.command.position.any() and "stiffness" not in one.command
    other.maps.add(other.maps["ACTUATED"], "FEEDBACK")
    assert "FEEDBACK" not in one.maps and "FEEDBACK" not in other.companion().maps


def test_a_writer_makes_the_next_reader_compute(pair):
    one, other = pair
    assert one.update() and not other.update()
    before = one.computations()["kinematics"]
    other.state.position[0] = 0.5
    assert one.computations()["kinematics"] == before
    version = one.state.version("position")
    assert one.update() and not other.update() and not one.update()
    assert one.computations()["kinematics"] == before + 1 == other.computations()["kinematics"]
    assert one.state.version("position") == other.state.version("position") == version + 1


def test_added_interfaces_have_one_array(pair):
    one, other = pair
    first = one.state.add("wear")
    second = other.state.add("wear")
    assert first is second and other.state["wear"] is first
    with pytest.raises(ModelError, match="has an interface 'wear' already"):
        one.state.add("wear")
    one.state.add("grip", 3)
    assert "grip" in other.state
    with pytest.raises(SizeMismatch, match="'grip' of 4 numbers, which another component has with 3"):
        other.state.add("grip", 4)


def test_every_computation_is_counted_once(pair):
    one, other = pair
    one.update()
    assert "bias" not in one.computations()
    for robot in (one, other, one):
        robot.update()
        _ = robot.center_of_mass, robot.contacts, robot.dynamics.inertia_inverse
    counts = {"kinematics": 1, "center_of_mass": 1, "contacts": 1, "center_of_pressure": 0}
    assert one.computations() == counts | {"bias": 0, "inertia": 1, "inertia_inverse": 1}
    _ = other.center_of_pressure, one.center_of_pressure  # forces may change without an update
    assert one.computations() == other.computations() != counts
    assert one.computations()["center_of_pressure"] == 2


def test_an_observer_learns_of_each_computation(pair):
    one, other = pair
    names = []
    ends = one.observe(names.append)
    other.state.velocity[8] = 1.0
    _ = other.dynamics.inertia_inverse, other.center_of_mass, one.dynamics.inertia
    assert names == ["kinematics", "inertia", "inertia_inverse", "center_of_mass"]
    for end in ends:
        end()
    other.state.velocity[8] = 2.0
    _ = other.dynamics.bias, other.contacts
    assert len(names) == 4 and "update" not in vars(one.kinematics)


def test_companions_compute_bitwise_what_others_do(pair):
    alone, generator = centauro(), np.random.default_rng(5)
    for _ in range(50):
        changed = generator.random(2) < 0.6
        for robot, writer in ((pair[0], pair[generator.integers(2)]), (alone, alone)):
            draw = np.random.default_rng(generator.bit_generator.state["state"]["state"] % 2**32)
            if changed[0]:
                writer.state.position = draw.uniform(-1.0, 1.0, robot.size)
            if changed[1]:
                writer.state.velocity[:] = draw.uniform(-1.0, 1.0, robot.size)
        reader = pair[generator.integers(2)]
        reader.update()
        alone.update()
        assert numbers(reader) == numbers(alone)
    assert pair[0].computations()["kinematics"] == alone.computations()["kinematics"] > 30


def numbers(robot):
    dynamics = robot.dynamics
    arrays = (robot.state.position, robot.center_of_mass.value, robot.center_of_mass.jacobian, robot.contacts.value)
    arrays += (robot.kinematics.jacobian("arm1_7"), dynamics.inertia, dynamics.bias, dynamics.inertia_inverse)
    return [array.tobytes() for array in arrays]


def test_a_robot_that_lacks_masses_of_others_is_a_part():
    """Of a model of the robot's upper body the legs lack masses; the whole robot lacks none of its own parts."""
    urdf = CENTAURO / "centauro.urdf"
    description = Description.from_file(urdf)
    lower, upper = (cut(description, "torso_2", keep) for keep in ("lower", "upper"))
    legs, whole = Robot.load(lower, others=[lower, upper]), Robot.load(urdf, others=[lower, upper])
    assert (legs.is_whole, whole.is_whole, Robot.load(urdf).is_whole) == (False, True, True)
    assert (legs.companion().is_whole, whole.twin().is_whole) == (False, True)
