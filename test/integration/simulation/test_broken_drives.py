"""Drives of the simulated robot that break, in both engines."""

from pathlib import Path

import numpy as np
import pytest

from solfer.errors import UnknownName
from solfer.simulation import Simulation
from solfer.simulation.world.records import ENGINES
from solfer.transport.messages import JointMessage

ROBOT = Path(__file__).resolve().parents[3] / "config/robots/centauro/robot.yaml"
WHEELS = tuple(f"j_wheel_{number}" for number in range(1, 5))
SPEEDS = np.array([1.0, -1.0, 1.0, -1.0])
ELBOW = "j_arm1_4"


@pytest.fixture(scope="module", params=ENGINES)
def simulation(request):
    """CENTAURO on a plane."""
    simulation = Simulation.from_file(ROBOT, engine=request.param)
    yield simulation
    simulation.close()


def command(simulation, duration, joints, **fields):
    """Command joints for a time [s]; return their mean velocities in the last half of it, shape (n,)."""
    level = simulation.lower_level
    dofs = [simulation.kinematics.dofs.index(joint) for joint in joints]
    seen = []
    for step in range(round(1000 * duration)):
        if step % 100 == 0:
            controller = "velocity_controller" if joints == WHEELS else "position_controller"
            level.accept(controller, JointMessage(joints, sender=f"start {level.starts}", **fields))
        simulation.step()
        seen.append(simulation.v[dofs])
    return np.mean(seen[len(seen) // 2 :], axis=0)


def test_a_wheel_that_is_stuck(simulation):
    simulation.reset()
    simulation.set_drive(WHEELS[0], "stuck")
    speeds = command(simulation, 1.0, WHEELS, velocity=SPEEDS)
    assert abs(speeds[0]) < 1e-3 and (np.abs(speeds[1:]) > 0.9).all()
    simulation.set_drive(WHEELS[0], "sound")
    np.testing.assert_allclose(command(simulation, 1.0, WHEELS, velocity=SPEEDS), SPEEDS, atol=0.05)


def test_a_wheel_that_is_free_rolls_along_without_a_torque(simulation):
    simulation.reset()
    simulation.set_drive(WHEELS[2], "free")
    speeds = command(simulation, 1.0, WHEELS, velocity=0.5 * SPEEDS)
    torques = np.abs(simulation.torque[[simulation.kinematics.dofs.index(wheel) for wheel in WHEELS]])
    np.testing.assert_allclose(speeds, 0.5 * SPEEDS, atol=0.1)
    assert torques[2] < 0.1 and np.delete(torques, 2).min() > 0.5  # its gear has friction


def test_an_elbow_that_is_stuck_or_free(simulation):
    """The free one sinks; a reset repairs it, and what follows repeats to the last bit."""
    dof = simulation.kinematics.dofs.index(ELBOW)
    simulation.reset()
    start = simulation.q[dof]
    command(simulation, 1.0, (ELBOW,), position=np.array([start + 0.2]))
    sound, before = simulation.q.copy(), simulation.q[dof]
    assert before == pytest.approx(start + 0.2, abs=0.05)
    simulation.set_drive(ELBOW, "stuck")
    command(simulation, 1.0, (ELBOW,), position=np.array([start - 0.2]))
    assert simulation.q[dof] == pytest.approx(before, abs=2e-3)
    simulation.set_drive(ELBOW, "free")
    command(simulation, 1.0, (ELBOW,), position=np.array([before]))
    assert abs(simulation.q[dof] - before) > 0.1
    simulation.reset()
    command(simulation, 1.0, (ELBOW,), position=np.array([start + 0.2]))
    assert np.array_equal(simulation.q, sound)


@pytest.mark.parametrize("joint", ["j_arm1_4", "hip_yaw_1", "ankle_yaw_3"])
@pytest.mark.parametrize("state", ["free", "stuck"])
def test_a_joint_that_is_repaired_far_from_its_command_goes_there_smoothly(simulation, joint, state):
    dof = simulation.kinematics.dofs.index(joint)
    simulation.reset()
    simulation.set_drive(joint, state)
    goal = simulation.q[dof] + 0.6
    command(simulation, 1.0, (joint,), position=np.array([goal]))
    assert abs(simulation.q[dof] - goal) > 0.25
    simulation.set_drive(joint, "sound")
    speeds = []
    for _ in range(20):
        command(simulation, 0.1, (joint,), position=np.array([goal]))
        speeds.append(abs(simulation.v[dof]))
    assert simulation.q[dof] == pytest.approx(goal, abs=0.05)
    assert max(speeds) < 0.3 * simulation.kinematics.velocity_limit[dof]


@pytest.mark.parametrize(
    ("joint", "state", "nearest"), [("j_wheel_5", "free", "j_wheel_4"), ("j_wheel_1", "fre", "free")]
)
def test_what_is_unknown_changes_nothing(simulation, joint, state, nearest):
    simulation.reset()
    with pytest.raises(UnknownName, match=nearest):
        simulation.set_drive(joint, state)
    assert not simulation.body.broken_drives
