"""CENTAURO drives and changes its posture."""

from pathlib import Path

import numpy as np
import pytest
from support.controllers import accept

from solfer.simulation import Simulation
from solfer.transport.messages import JointMessage

WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")
FORWARD = np.array([1.0, -1.0, 1.0, -1.0])  # the axles of the right wheels point to the right
RADIUS = 0.078  # [m]
ROBOT = Path(__file__).resolve().parents[3] / "config/robots/centauro/robot.yaml"
PERIOD = 5  # [steps] between commands


@pytest.fixture
def simulation():
    """CENTAURO, standing for half a second."""
    simulation = Simulation.from_file(ROBOT)
    for _ in range(500):
        simulation.step()
    yield simulation
    simulation.close()


def roll(simulation, speed):
    """Command the wheels to roll forward at a speed [m/s]."""
    simulation.lower_level.accept("velocity_controller", JointMessage(WHEELS, velocity=FORWARD * speed / RADIUS))


def ramp(simulation, state, rate=0.5):
    """Move all joints at `rate` [rad/s] at most to a named state, then wait a second; smallest number of contacts."""
    named = Simulation.from_file(ROBOT, state=state)
    controller = simulation.lower_level.controller("position_controller")
    goal = named.q[controller.dofs]
    named.close()
    begin = controller.position.copy()
    steps = int(np.abs(goal - begin).max() / rate * 1000)
    contacts = 4
    for step in range(steps + 1000):
        if step % PERIOD == 0:
            share = min((step + PERIOD) / steps, 1.0)
            accept(controller, JointMessage(controller.joints, position=begin + share * (goal - begin)))
        simulation.step()
        contacts = min(contacts, len(simulation.contact_links()))
    return contacts


def test_it_drives_one_metre_straight(simulation):
    begin = simulation.body.position.copy()
    contacts = []
    for step in range(5500):
        if step % PERIOD == 0:
            time = (step + PERIOD / 2) * 1e-3
            roll(simulation, 0.25 * np.clip(min(time, 5.0 - time), 0.0, 1.0))  # 1 s up, 3 s at 0.25 m/s, 1 s down
        simulation.step()
        contacts.append(len(simulation.contact_links()))
    way = simulation.body.position - begin
    assert way[0] == pytest.approx(1.0, abs=5e-3)
    assert abs(way[1]) < 5e-3
    assert np.abs(simulation.q[3:6]).max() < 0.01
    assert min(contacts) == 4


def test_wheels_stop_without_commands(simulation):
    for step in range(1000):
        if step % PERIOD == 0:
            roll(simulation, 0.1)
        simulation.step()
    dofs = simulation.lower_level.drives.speed_dofs
    np.testing.assert_allclose(simulation.v[dofs] * FORWARD, 0.1 / RADIUS, rtol=0.02)
    for _ in range(1000):
        simulation.step()
    np.testing.assert_allclose(simulation.v[dofs], 0.0, atol=0.02)


@pytest.mark.soak
def test_it_rises_and_lowers_itself_on_its_feet(simulation):
    low = simulation.body.position[2]
    ramp(simulation, "mammal_wide_high")
    high = simulation.body.position[2]
    ramp(simulation, "mammal_wide_straight")
    assert high - low == pytest.approx(0.09, abs=0.01)
    assert simulation.body.position[2] == pytest.approx(low, abs=2e-3)
    assert len(simulation.contact_links()) == 4
    assert np.degrees(np.abs(simulation.q[3:6])).max() < 1.0


def test_a_jump_of_a_target_is_smooth(simulation):
    """A fifth of the speed limit at most, and the springs behind it swing a little."""
    index = simulation.kinematics.dofs.index("torso_yaw")
    limit = simulation.kinematics.velocity_limit[index]
    simulation.lower_level.accept("position_controller", JointMessage(("torso_yaw",), position=np.array([1.0])))
    speeds = []
    for _ in range(2500):
        simulation.step()
        speeds.append(abs(simulation.v[index]))
    assert 0.15 * limit < max(speeds) < 0.35 * limit
    assert simulation.q[index] == pytest.approx(1.0, abs=0.02)
