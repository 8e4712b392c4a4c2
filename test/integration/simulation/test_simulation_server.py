"""The simulation's server on a virtual clock, with plugins' side of the pipes in the same process."""

import numpy as np
import pytest
from support.integration.world import perfect

from solfer.errors import SimulationError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.simulation import Rates, Simulation, SimulationServer
from solfer.transport.messages import JointMessage


@pytest.fixture(scope="module")
def simulation():
    """CENTAURO."""
    simulation = Simulation.from_file(perfect())
    yield simulation
    simulation.close()


@pytest.fixture
def world(simulation):
    """(bus, server, a plugin's middleware); the server cycles every millisecond."""
    simulation.reset()
    while simulation.count % 1000:  # publications and reports are due at whole seconds
        simulation.step()
    simulation.reset()
    bus = Bus()
    server = SimulationServer(simulation, MemoryMiddleware(bus, "simulation"))
    bus.every(0.001, server.cycle)
    return bus, server, MemoryMiddleware(bus, "plugin")


def test_it_publishes_what_is_due_in_simulated_time(world):
    bus, server, plugin = world
    joints, base = (
        plugin.queue(topic, message, size=1000)
        for topic, message in (("joint_states", "sensor_msgs/JointState"), ("floating_base", "nav_msgs/Odometry"))
    )
    begin = server.simulation.time
    bus.run_until(0.1)
    states, poses = joints.drain(), base.drain()
    np.testing.assert_allclose([state.stamp for state in states], begin + np.arange(1, 21) * 0.005)
    np.testing.assert_allclose([pose.stamp for pose in poses], begin + np.arange(1, 21) * 0.005)
    assert states[-1].names == server.simulation.kinematics.dofs[6:]
    assert not np.array_equal(states[0].position, states[-1].position)  # each has numbers of its own
    np.testing.assert_array_equal(states[-1].position, server.simulation.q[6:])
    assert (poses[0].frame, poses[0].child) == ("world", "pelvis")


def test_a_wrong_command_is_only_logged_once(world, caplog):
    bus, server, plugin = world
    writer = plugin.writer("velocity_controller/command", "solfer/JointCommand")
    before = server.simulation.lower_level.refused
    for _ in range(20):
        writer.write(JointMessage(("j_wheel_1",), velocity=np.array([np.nan])))
        bus.run_until(bus.time + 0.01)
    assert server.simulation.lower_level.refused == before + 20
    assert not server.simulation.lower_level.drives.speed.any()
    (warning,) = [record.getMessage() for record in caplog.records]
    for text in ("'plugin'", "velocity_controller", "j_wheel_1", "not a finite number"):
        assert text in warning


def test_controllers_report_their_joints(world):
    _, server, plugin = world
    lower_level = server.simulation.lower_level
    for name in ("position_controller", "velocity_controller"):
        assert plugin.controller_joints(name, timeout=0.1) == lower_level.controller(name).joints
    assert set(plugin.controller_joints("velocity_controller", 0.1)) == {f"j_wheel_{leg}" for leg in (1, 2, 3, 4)}


def test_its_health_reports_refusals_and_contacts(world):
    bus, server, plugin = world
    bus.run_until(1.01)
    report = bus.reports["simulation"]
    assert (report.level, report.summary) == (0, "running")
    assert report.values["contacts"] == "wheel_1 wheel_2 wheel_3 wheel_4"
    plugin.writer("velocity_controller/command", "solfer/JointCommand").write(JointMessage(("j_wheel_1",)))
    bus.run_until(2.02)
    report = bus.reports["simulation"]
    assert (report.level, report.summary) == (1, "1 commands refused")


def test_a_failing_call_stops_no_loop(world):
    bus, server, _ = world
    future = server.inbox.submit(lambda: 1 / 0)
    bus.run_until(0.002)
    assert isinstance(future.exception(timeout=0), ZeroDivisionError)
    assert server.simulation.count >= 1


@pytest.mark.parametrize("rate", [300.0, 700.0])
def test_rates_that_are_no_whole_number_of_steps(simulation, rate):
    with pytest.raises(SimulationError, match="is not a rate of publication"):
        SimulationServer(simulation, MemoryMiddleware(Bus(), "simulation"), Rates(joints=rate))


def test_a_robot_that_moves_rests_at_the_end(simulation, world):
    bus, server, _ = world
    joints = simulation.lower_level.controllers["velocity_controller"].joints
    wheels = [simulation.kinematics.dofs.index(joint) for joint in joints]
    writer = MemoryMiddleware(bus, "driver").writer("velocity_controller/command", "solfer/JointCommand")
    writer.write(JointMessage(joints, velocity=np.full(len(joints), 1.0)))
    bus.run_until(0.25)
    assert np.abs(simulation.v[wheels]).min() > 0.5
    bus.ended, count = True, simulation.count
    writer.write(JointMessage(joints, velocity=np.zeros(len(joints))))  # who drives it ends in order
    server.rest()
    assert np.abs(simulation.v[wheels]).max() < 0.05 and 50 < simulation.count - count < 1000
    rested = simulation.count
    server.rest()
    assert simulation.count == rested
